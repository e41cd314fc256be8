"""
Fit parameters of a servo file to bags, and write a servo file with what was found.

Free are the parameters named by --free, else those that the servo file gives a tolerance. Each
value in the new file has its standard error and the bags, with hash, that it comes from. With
--learn friction, backlash or transmission_error an effect is learned instead of parameters fitted.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import sys

from servo_twin import servo_file
from servo_twin.bag import read_recording
from servo_twin.physics.servo import Servo
from servo_twin.recording import Recording

from .estimate import Estimate
from .output_error import fit, Progress, WEIGHTS
from .segments import INPUT_OF

LEARNED = ('physical', 'friction', 'backlash', 'transmission_error')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('bags', type=Path, nargs='+', metavar='BAG')
    parser.add_argument('--servo', type=Path, required=True, help='servo file to begin with')
    parser.add_argument('-o', '--output', type=Path, required=True, help='servo file to write')
    parser.add_argument('--free', nargs='+', metavar='PATH', default=(),
                        help='parameters to fit; left out, all that have a tolerance')
    parser.add_argument('--learn', choices=LEARNED, default='physical')
    parser.add_argument('--mode', choices=list(INPUT_OF), default='measured_input',
                        help='closed_loop simulates the controller with the recorded reference, '
                        'for disturbances that come back through it')
    parser.add_argument('--horizon', type=float, help='s between restarts; left out, by the data')
    parser.add_argument('--weights', choices=WEIGHTS, default='residual')
    parser.add_argument('--no-delays', action='store_true',
                        help='do not estimate how late each channel is')
    parser.add_argument('--beyond-tolerance', action='store_true',
                        help='let values leave the tolerance of the servo file')
    parser.add_argument('--robust', action='store_true', help="Huber's loss instead of squares")
    parser.add_argument('--namespace', help='rig to read where a bag has several')
    parser.add_argument('--report', type=Path, help='JSON file to write the whole estimate to')


def main(arguments: argparse.Namespace) -> int:
    """Fit and write; nothing is written when the fit fails."""
    servo = servo_file.load(arguments.servo)
    if not arguments.output.parent.is_dir():
        raise ValueError(f'{arguments.output}: there is no folder {arguments.output.parent}')
    recordings = [read_recording(bag, arguments.namespace) for bag in arguments.bags]
    for recording in recordings:
        for warning in recording.warnings:
            print(f'{recording.name}: {warning}', file=sys.stderr)
    if arguments.learn != 'physical':
        from ..learning import learn
        if arguments.free:
            raise ValueError(f'--free is for --learn physical, not {arguments.learn}')
        learned, said = learn(arguments.learn, servo, recordings)
        write(learned, arguments.output)
        print('\n'.join([*said, f'written to {arguments.output}']))
        return 0
    free = list(arguments.free) or list(servo.tolerance)
    if not free:
        raise ValueError(f'{arguments.servo}: no parameter has a tolerance; name some by --free')
    estimate = _fitted(servo, recordings, free, arguments)
    if arguments.report:
        estimate.save(arguments.report)
    write(estimate.servo, arguments.output)
    _show(estimate, servo)
    print(f'written to {arguments.output}')
    return 0


def _fitted(servo: Servo, recordings: list[Recording], free: list[str],
            arguments: argparse.Namespace) -> Estimate:
    with _shown() as progress:
        return fit(servo, recordings, free, mode=arguments.mode, horizon=arguments.horizon,
                   tolerance=not arguments.beyond_tolerance, delays=not arguments.no_delays,
                   robust=arguments.robust, weights=arguments.weights, progress=progress)


@contextmanager
def _shown() -> Iterator:
    """Show a fit's progress on the terminal; its warnings stay."""
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (SpinnerColumn(), TextColumn('{task.description}'), TimeElapsedColumn())
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task('simulating')

        def told(progress: Progress) -> None:
            for warning in progress.warnings:
                console.print(f'warning: {warning}', style='yellow', markup=False)
            bar.update(task, description=f'step {progress.iteration}, cost {progress.cost:.6g}')

        yield told


def write(servo: Servo, path: Path) -> None:
    """Write a servo file whole or not at all."""
    draft = path.with_name(f'.{path.name}.{os.getpid()}')
    try:
        servo_file.save(servo, draft)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def _show(estimate: Estimate, before: Servo) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(width=None if sys.stdout.isatty() else 110)
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
    for channel, rms in estimate.rms.items():
        console.print(f'{channel}: residual {estimate.rms_before[channel]:.4g} -> {rms:.4g}, '
                      f'noise floor {estimate.noise[channel]:.3g}', highlight=False)
    for channel, delay in estimate.delays.items():
        console.print(f'{channel} is late by {1e3 * delay:.3f} ± '
                      f'{1e3 * estimate.delay_std[channel]:.3f} ms', highlight=False)
    for warning in estimate.warnings:
        console.print(f'warning: {warning}', style='yellow', markup=False)
