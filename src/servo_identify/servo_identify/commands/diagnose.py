"""
Say where a twin departs from its rig, which effect is missing, and how far the gap shrinks.

Give it recordings (bags) of one machine and its servo file; it writes report.json, report.html
and augmented.yaml. Without --accept and --report it parts the recordings itself. Of a recording
of more than 300000 samples (five minutes at 1 kHz) it takes ten parts, and says which.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import shlex
import sys
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import new_folder, tell, terminal

from ..data.arguments import add_data, DESPITE, files, recordings_looked_at, stretch_of
from ..experiment.reach_limits import check_reach, REACH

if TYPE_CHECKING:
    from rich.console import Console

FAIL_ON = {'gap': ('explained', 'partly_explained', 'unknown'), 'unknown': ('unknown',)}
APART = 0.05  # by which the shrink of an effect alone may differ from that of the sentence
SHRINK = ('shrink: what comes back of the error where this effect alone is taken out of the new '
          'file. The sentence tells what all that differs in the new file removes together.')
GAP_THERE = 3  # exit status where --fail-on finds what it names


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `servo-identify diagnose`."""
    add_data(parser, nargs='*')
    parser.add_argument('--accept', nargs='+', default=[], metavar='BAG',
                        help='recordings on which an effect must prove itself')
    parser.add_argument('--report', nargs='+', default=[], metavar='BAG',
                        help='recordings on which the shrink is measured')
    parser.add_argument('-o', '--output', required=True, metavar='DIR')
    parser.add_argument('--despite-check', action='store_true', help=DESPITE)
    parser.add_argument('--effects', metavar='FOLDER',
                        help='folder of effect files of your own; their code is run')
    parser.add_argument('--without', nargs='+', default=[], metavar='EFFECT',
                        help='effects, as a report names them, that are not considered')
    parser.add_argument('--refit', action='store_true',
                        help='augmented.yaml has the values moved within tolerance as well')
    parser.add_argument('--reach', type=reach_of, default={}, metavar='travel=2,torque=1.5',
                        help='what the next experiment may reach: ' + ', '.join(
                            f'{name} {unit}' for name, unit in REACH.items()))
    parser.add_argument('--fail-on', choices=tuple(FAIL_ON),
                        help=f'exit status {GAP_THERE} where there is a gap, or an unknown one')
    parser.add_argument('--no-page', action='store_true', help='leave report.html out')
    parser.add_argument('--jobs', type=Path, metavar='RIGS.yaml',
                        help='many machines: name: {servo: FILE, bags: [FILE, ...]} for each, and '
                        'mapping: FILE where columns have other names')
    parser.add_argument('--cluster', default='', metavar='ADDRESS',
                        help='Dask scheduler for --jobs; left out, processes of this machine')


def reach_of(text: str) -> dict[str, float]:
    """Return limits by name; raises ArgumentTypeError that names what is wrong."""
    found = {}
    for part in text.split(','):
        name, _, value = part.partition('=')
        try:
            found[name] = float(value)
        except ValueError:
            raise argparse.ArgumentTypeError(f'{name} = {value!r} is no number') from None
    try:
        check_reach(found)
    except ValueError as problem:
        raise argparse.ArgumentTypeError(str(problem)) from None
    return found


def main(arguments: argparse.Namespace) -> int:
    """Diagnose; returns 0 when there is an answer. Raises ValueError with a sentence otherwise."""

    from ..data.stretch import ALL

    if arguments.jobs:
        if stretch_of(arguments) != ALL:
            raise ValueError('--from and --to are of the recordings of one machine; leave them '
                             'out beside --jobs')
        from ..jobs.many_diagnoses import run_all
        ended = run_all(arguments.jobs, Path(arguments.output), arguments.cluster,
                        force=arguments.force, quiet=arguments.quiet)
        tell(arguments, machines=[vars(done) for done in ended], written=[arguments.output])
        return int(any(done.problem for done in ended))
    if not arguments.bags or not arguments.servo:
        raise ValueError('diagnose needs recordings and --servo SERVO.yaml (or --jobs RIGS.yaml)')
    from servo_twin.description import servo_file
    from servo_twin.physics import catalogue

    from ..diagnose.diagnosis_files import write_diagnosis
    from ..diagnose.mechanisms.every_hypothesis import check_without
    from ..experiment.next_command import next_command

    if arguments.effects:
        print(f'running the code of the effects in {arguments.effects}', file=sys.stderr)
        catalogue.register(arguments.effects)
    for paths in (arguments.bags, arguments.accept, arguments.report):
        files(paths)
    path = arguments.servo
    servo, text = servo_file.load(path), Path(path).read_text()
    check_without(arguments.without, servo)
    output = new_folder(arguments.output, arguments.force, 'report.json', 'augmented.yaml')
    console = terminal()
    found = _diagnosed(arguments, servo, console)
    following = found.report.next_experiment
    if following.get('command'):
        following['command'] = next_command(following, servo, path, found.recordings)
    write_diagnosis(found, text, servo, output, arguments.refit, not arguments.no_page,
                    shlex.join(['servo-identify', *sys.argv[1:]]))
    names = ['report.json', 'augmented.yaml'] + ['report.html'] * (not arguments.no_page)
    tell(arguments, **found.report.as_dict(), written=[output / name for name in names])
    if arguments.quiet:
        for warning in found.report.warnings:
            print(f'warning: {warning}', file=sys.stderr)
    else:
        _show(found.report, console)
    console.print(found.report.verdict['sentence'], style='bold', highlight=False)
    if not arguments.quiet:
        _show_next(found.report, console)
        console.print(f'{output}: {", ".join(names)}', style='dim', highlight=False)
    status = found.report.verdict['status']
    return GAP_THERE if status in FAIL_ON.get(arguments.fail_on, ()) else 0


def _diagnosed(arguments: argparse.Namespace, servo, console: Console):
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from ..diagnose.diagnose import diagnose
    from ..diagnose.stages import STAGES

    with Progress(TextColumn('{task.description:<16}'), BarColumn(), TimeElapsedColumn(),
                  console=console, disable=arguments.quiet) as progress:
        tasks = {stage: progress.add_task(stage, total=1.0, visible=False) for stage in STAGES}

        def tick(stage, share):
            for earlier in STAGES[:STAGES.index(stage)]:
                progress.update(tasks[earlier], completed=1.0)
            progress.update(tasks[stage], completed=share, visible=True)

        tick('reading', 0.0)
        several = recordings_looked_at(arguments, arguments.bags, arguments.accept,
                                       arguments.report)
        found = diagnose(several[0], servo, several[1], several[2], tuple(arguments.without),
                         tick, arguments.reach, arguments.despite_check)
        tick(STAGES[-1], 1.0)
    return found


def _show(report, console: Console) -> None:
    from rich.table import Table

    from ..diagnose.answer.sizes import values_of

    where = Table('equation', 'residual / noise', 'share', 'verdict', title='Where')
    for one in report.where:
        seen = one.verdict != 'not observable'
        where.add_row(one.balance, f'{one.gap_to_noise:.1f}' if seen else '-',
                      f'{100 * one.share:.0f} %' if seen else '-', one.verdict)
    console.print(where)
    if report.which:
        which = Table('effect', 'at', 'known (confidence)', 'values', 'shrink', 'or else',
                      title='Which')
        for one in report.which:
            which.add_row(one.effect, one.site,
                          f'{one.rung} ({100 * one.confidence["mechanism"]:.0f} %)',
                          '\n'.join(values_of(one.parameters)), _share(one.shrink_realised),
                          ', '.join(one.ambiguous_with))
        console.print(which)
        if any(abs(one.shrink_realised - report.gap['shrink']) > APART for one in report.which):
            console.print(SHRINK, highlight=False)
    for warning in report.warnings:
        console.print(warning, style='yellow', highlight=False, markup=False)
    if report.defaults:
        console.print('defaults taken: ' + ', '.join(
            f'{one["path"]} = {one["value"]} {one["unit"]}'.rstrip()
            for one in report.defaults), style='yellow', highlight=False)


def _share(shrink: float) -> str:
    return f'{100.0 * shrink:.0f} %' if shrink >= 0.005 else 'none'


def _show_next(report, console: Console) -> None:
    for line in report.confirm:
        console.print(line, highlight=False)
    following = report.next_experiment
    if following.get('command'):
        console.print(f'To tell {" from ".join(following["separates"])}, record next:\n'
                      f'  {following["command"]}', highlight=False)
        for effect, said in following['expected'].items():
            console.print(f'  {effect} would give a {said}', highlight=False)
    elif following.get('measure'):
        value = following['measure']
        told = ', '.join(f'{v:.4g} {value["unit"]} would mean {name}'
                         for name, v in value['values'].items())
        console.print(f'To tell {" from ".join(following["separates"])}, measure '
                      f'{value["parameter"]}: {told}.', highlight=False)
    elif following.get('separates'):
        console.print(f'No motion that this rig was seen to do tells '
                      f'{" from ".join(following["separates"])}: let it do more (--reach), or add '
                      'a sensor between them.', highlight=False)
