"""
Fit parameters of a servo file to bags, and write a servo file with what was found.

Free are the parameters named by --free, else those that the servo file gives a tolerance. Each
value in the new file has its standard error and the bags, with hash, that it comes from. With
--learn friction, backlash or transmission_error an effect is learned instead of parameters fitted.

Many rigs, many bags: --each fits every bag by itself, --jobs FILE does the fits that a YAML file
names (--jobs-help shows one). They run side by side on this machine, or on the Dask cluster at
--cluster. The output is then a folder with a servo file and an estimate for each. A fit that
fails, or whose worker dies, costs itself only.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import new_file, new_folder, say, tell, terminal

from ..data.arguments import add_data, DESPITE, files, stretch_of
from ..fit.fit_choices import INPUT_OF, LEARNED, WEIGHTS

if TYPE_CHECKING:
    from servo_twin.physics.servo import Servo

    from ..fit.estimate import Estimate
    from ..fit.output_error import Progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    add_data(parser, nargs='*')
    parser.add_argument('-o', '--output', type=Path,
                        help='servo file to write; with --each or --jobs a folder')
    parser.add_argument('--free', nargs='+', metavar='PATH', default=(),
                        help='parameters to fit; left out, all that have a tolerance')
    parser.add_argument('--learn', choices=LEARNED, default='physical')
    parser.add_argument('--mode', choices=list(INPUT_OF), default='measured_input',
                        help='closed_loop simulates the controller with the recorded reference, '
                        'for disturbances that come back through it; forced_motion leads the '
                        'motor by its encoder, for two encoders alone')
    parser.add_argument('--horizon', type=float, help='s between restarts; left out, by the data')
    parser.add_argument('--weights', choices=WEIGHTS, default='residual')
    parser.add_argument('--no-delays', action='store_true',
                        help='do not estimate how late each channel is')
    parser.add_argument('--beyond-tolerance', action='store_true',
                        help='let values leave the tolerance of the servo file')
    parser.add_argument('--robust', action='store_true', help="Huber's loss instead of squares")
    parser.add_argument('--report', type=Path, help='JSON file to write the whole estimate to')
    parser.add_argument('--despite-check', action='store_true', help=DESPITE)
    many = parser.add_argument_group('many rigs, many bags')
    many.add_argument('--each', action='store_true', help='fit every bag by itself')
    many.add_argument('--jobs', type=Path, metavar='FILE', help='YAML file of fits')
    many.add_argument('--jobs-help', action='store_true', help='show what such a file says')
    many.add_argument('--cluster', default='', metavar='ADDRESS',
                      help='Dask scheduler, as tcp://HOST:8786; left out, processes of this '
                      'machine')
    many.add_argument('--workers', type=int, default=0, help='processes of this machine; 0: all '
                      'cores')


def main(arguments: argparse.Namespace) -> int:
    """Fit and write; nothing is written when the fit fails."""
    from servo_twin.description import servo_file

    from ..jobs.fit_jobs import each, Job, read_jobs, run, Settings

    if arguments.jobs_help:
        print(read_jobs.__doc__)
        return 0
    settings = Settings(
        tuple(arguments.free), arguments.learn, arguments.mode, arguments.horizon,
        arguments.weights, not arguments.no_delays, arguments.beyond_tolerance, arguments.robust,
        arguments.namespace, str(arguments.mapping) if arguments.mapping else None,
        stretch_of(arguments), arguments.despite_check)
    _complete(arguments)
    bags = tuple(files(arguments.bags))
    if arguments.jobs or arguments.each:
        from ..jobs.many_fits import run_all, told
        jobs = (read_jobs(arguments.jobs, vars(settings)) if arguments.jobs
                else each(arguments.servo, bags, settings))
        new_folder(arguments.output, arguments.force, *(f'{name}.yaml' for name in jobs))
        ended = run_all(jobs, arguments.output, arguments.cluster, arguments.workers,
                        arguments.quiet)
        tell(arguments, fits=[told(done) for done in ended], written=[arguments.output])
        return int(any(done.problem for done in ended))
    new_file(arguments.output, arguments.force)
    if arguments.report:
        new_file(arguments.report, arguments.force)
    with _shown(arguments.quiet) as progress:
        answer = run(Job(arguments.servo, bags, settings), progress)
    if answer.estimate and arguments.report:
        answer.estimate.save(arguments.report)
    servo_file.save(answer.servo, arguments.output)
    tell(arguments, said=answer.said, written=[
        arguments.output, *([arguments.report] if answer.estimate and arguments.report else [])])
    if answer.estimate:
        tell(arguments, **answer.estimate.as_dict())
        if not arguments.quiet:
            _show(answer.estimate, servo_file.load(arguments.servo))
        for warning in answer.estimate.warnings:
            print(f'warning: {warning}', file=sys.stderr)
    say(arguments, *answer.said, f'written to {arguments.output}')
    return 0


def _complete(arguments: argparse.Namespace) -> None:
    """Refuse options that do not go together."""
    alone = ('bags', 'servo', 'each') if arguments.jobs else ()
    for name in alone:
        if getattr(arguments, name):
            raise ValueError(f'--jobs names servo files and bags itself; leave out {name}')
    needed = ('output',) if arguments.jobs else ('bags', 'servo', 'output')
    for name in needed:
        if not getattr(arguments, name):
            raise ValueError(f'{name} is missing; --help says what is needed')
    if not (arguments.jobs or arguments.each) and (arguments.cluster or arguments.workers):
        raise ValueError('--cluster and --workers are for several fits: --each or --jobs')
    if (arguments.jobs or arguments.each) and arguments.report:
        raise ValueError('--report is for one fit; several write a report each beside the servo')


@contextmanager
def _shown(quiet: bool) -> Iterator:
    """Show a fit's progress on the terminal; its warnings stay."""
    from rich.progress import Progress as Bar
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    console = terminal(stderr=True, quiet=quiet)
    columns = (SpinnerColumn(), TextColumn('{task.description}'), TimeElapsedColumn())
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task('simulating')

        def told(progress: Progress) -> None:
            for warning in progress.warnings:
                console.print(f'warning: {warning}', style='yellow', markup=False)
            bar.update(task, description=f'step {progress.iteration}, cost {progress.cost:.6g}')

        yield told


def _show(estimate: Estimate, before: Servo) -> None:
    from rich.table import Table

    console = terminal()
    table = Table(title=f'{estimate.servo.name}: {estimate.iterations} steps in '
                  f'{estimate.seconds:.1f} s, horizon {estimate.horizon:.3g} s',
                  title_justify='left')
    for heading in ('parameter', 'before', 'value', 'standard error', 'unit'):
        table.add_column(heading, justify='left' if heading in ('parameter', 'unit') else 'right')
    for name in estimate.names:
        path, _, rest = name.partition('[')
        old = before.values[path]
        old = old[int(rest[:-1])] if rest else old
        table.add_row(name, f'{old:.6g}', f'{estimate.values[name]:.6g}',
                      f'{estimate.std[name]:.2g}', estimate.units[name])
    console.print(table)
    for line in estimate.by_channel():
        console.print(line, highlight=False)
