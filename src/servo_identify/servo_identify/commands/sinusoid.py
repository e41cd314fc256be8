"""
Recover the sinusoid in a recording: frequency by the spectrum, then phase by optimisation.

Any bag, any column. Left out, the column is the first of position reference, speed reference,
command, motor position and load position that the bag has: the command where there is one, and
else what answered to it.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import say, tell
from servo_twin.recording.channels import COLUMNS

from ..data.arguments import add_data, files

if TYPE_CHECKING:
    from servo_twin.recording.recording import Recording

    from ..learn.sinusoid.sinusoid_recovery import Sinusoid

USUAL = ('reference_position', 'reference_velocity', 'voltage', 'motor_position', 'load_position')
POOR = 0.9  # share of the variance below which a record is hardly a sinusoid


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    add_data(parser, servo=False)
    parser.add_argument('--column', choices=list(COLUMNS), help='default: see above')


def main(arguments: argparse.Namespace) -> int:
    """Print a line a bag."""

    from ..data.reading import read_recordings

    found = []
    for bag in files(arguments.bags):  # whole: the phase is that at its first sample
        recording, = read_recordings([bag], None, arguments.mapping, arguments.namespace)
        column, sine = of_recording(recording, arguments.column, arguments.begin, arguments.end)
        found.append({'bag': bag, 'column': column, **asdict(sine)})
        say(arguments, said(bag.name, column, sine))
    tell(arguments, sinusoids=found)
    return 0


def of_recording(recording: Recording, column: str | None = None, begin: float = 0.0,
                 end: float | None = None) -> tuple[str, Sinusoid]:
    """
    Return the column and the sinusoid in it, between the instants ``begin`` and ``end``, s.

    The phase is that at the first sample of the recording. Raises SinusoidError.
    """
    from ..learn.sinusoid.sinusoid_recovery import recovered, SinusoidError

    if column is None:
        column = next((name for name in USUAL if recording.has(name)), None)
        if column is None:
            raise SinusoidError(f'{recording.name} has none of {list(USUAL)}')
    if not recording.has(column):
        there = [name for name in COLUMNS if recording.has(name)]
        raise SinusoidError(f'{recording.name} has no {column}; it has {there}')
    if end is not None and not begin < end:
        raise SinusoidError(f'from {begin:g} s to {end:g} s there is nothing')
    signal = recording[column].copy()
    inside = recording.time >= begin - 0.5 * recording.period
    if end is not None:
        inside &= recording.time < end - 0.5 * recording.period
    signal[~inside] = float('nan')
    try:
        return column, recovered(signal, recording.period)
    except SinusoidError as problem:
        raise SinusoidError(f'{recording.name}, {column}: {problem}') from None


def said(name: str, column: str, sine: Sinusoid) -> str:
    """Return what was found as text."""
    unit = COLUMNS[column]
    text = (f'{name}, {column}: {sine.frequency:.8g} Hz ± {sine.frequency_std:.2g}, phase '
            f'{sine.phase:.6g} rad ± {sine.phase_std:.2g}, amplitude {sine.amplitude:.6g} {unit} '
            f'± {sine.amplitude_std:.2g}, offset {sine.offset:.4g} {unit}; the spectrum alone '
            f'says {sine.peak:.6g} Hz; {100.0 * sine.explained:.4g} % of the variance')
    if sine.explained < POOR:
        text += f'\n{name}: warning: hardly a sinusoid; {sine.residual:.3g} {unit} rms are left'
    return text
