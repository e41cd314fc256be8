"""
Say where a twin departs from its rig, which effect causes it, and how far the gap shrinks.

Give it recordings (bags) of one machine and its servo file; it writes report.json, report.html
and augmented.yaml. Without --accept and --report it parts the recordings itself.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from ..gap.sentence import next_step


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `servo-identify diagnose`."""
    parser.add_argument('bags', nargs='+', metavar='BAG', help='recordings that select')
    parser.add_argument('--servo', required=True, metavar='SERVO.yaml', help='servo file')
    parser.add_argument('--accept', nargs='+', default=[], metavar='BAG',
                        help='recordings on which an effect must prove itself')
    parser.add_argument('--report', nargs='+', default=[], metavar='BAG',
                        help='recordings on which the shrink is measured')
    parser.add_argument('-o', '--output', required=True, metavar='DIR')
    parser.add_argument('--effects', metavar='FOLDER', help='folder of effect files of your own')
    parser.add_argument('--without', nargs='+', default=[], metavar='CAUSE',
                        help='causes, as a report names them, that shall not be considered')
    parser.add_argument('--no-page', action='store_true', help='leave report.html out')


def main(arguments: argparse.Namespace) -> int:
    """Diagnose; returns 0 when there is a verdict. Raises ValueError with a sentence otherwise."""
    from servo_twin.bag import read_recording
    from servo_twin.description import servo_file
    from servo_twin.physics import catalogue

    from ..gap.diagnose import diagnose
    from ..gap.stages import STAGES

    if arguments.effects:
        catalogue.register(arguments.effects)
    servo = servo_file.load(arguments.servo)
    output = Path(arguments.output)
    output.mkdir(parents=True, exist_ok=True)
    console = Console()
    with Progress(TextColumn('{task.description:<14}'), BarColumn(), TimeElapsedColumn(),
                  console=console) as progress:
        tasks = {stage: progress.add_task(stage, total=1.0, visible=False) for stage in STAGES}

        def tick(stage, share):
            for earlier in STAGES[:STAGES.index(stage)]:
                progress.update(tasks[earlier], completed=1.0)
            progress.update(tasks[stage], completed=share, visible=True)

        tick('reading', 0.0)
        bags = {name: [read_recording(b) for b in paths] for name, paths in
                (('bags', arguments.bags), ('accept', arguments.accept),
                 ('report', arguments.report))}
        found = diagnose(bags['bags'], servo, bags['accept'], bags['report'],
                         tuple(arguments.without), tick)
        tick('shrink', 1.0)
    found.report.save(output / 'report.json')
    servo_file.save(found.augmented, output / 'augmented.yaml')
    if not arguments.no_page:
        from ..gap.page import write_page
        write_page(found, output / 'report.html')
    _show(found.report, found.evidence.servo.linear, console)
    console.print(f'[dim]{output / "report.json"}, report.html, augmented.yaml[/dim]')
    return 0


def _show(report, linear: bool, console: Console) -> None:
    where = Table('balance', 'gap / noise', 'share', 'verdict', title='Where')
    for one in report.where:
        seen = one.verdict != 'not observable'
        where.add_row(one.balance, f'{one.gap_to_noise:.1f}' if seen else '-',
                      f'{100 * one.share:.0f} %' if seen else '-', one.verdict)
    console.print(where)
    if report.which:
        which = Table('effect', 'at', 'values', 'shrink', 'or', title='Which')
        for cause in report.which:
            values = ', '.join(f'{n} {v["value"]:.4g} {v["unit"]}'
                               for n, v in cause.parameters.items())
            which.add_row(cause.effect, cause.site, values,
                          f'{100 * cause.shrink_realised:.0f} %', ', '.join(cause.ambiguous_with))
        console.print(which)
    for warning in report.warnings:
        console.print(f'[yellow]{warning}[/yellow]')
    console.print(f'[bold]{report.verdict["sentence"]}[/bold]')
    if report.next_experiment:
        console.print(next_step(report.next_experiment, linear))
