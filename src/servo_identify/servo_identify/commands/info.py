"""Say what bags hold: duration, rate, channels with their ranges, family, gaps, warnings."""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import tell, terminal

from ..data.arguments import add_data, files, recordings

if TYPE_CHECKING:
    from servo_twin.recording.recording import Recording


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    add_data(parser, servo=False)


def main(arguments: argparse.Namespace) -> int:
    """Print a table a bag; 2 when one of them cannot be read, after the others."""
    from ..data.recording_facts import facts_of

    console = terminal(quiet=arguments.quiet)
    failed, found = list[str](), []
    for named in arguments.bags:
        try:
            for path in files([named]):
                recording, = recordings(arguments, [path])
                _show(console, path, recording)
                found.append(facts_of(path, recording))
        except (ValueError, OSError) as error:
            print(f'servo-identify info: {error}', file=sys.stderr)
            failed.append(str(error))
    tell(arguments, recordings=found, **({'error': '; '.join(failed)} if failed else {}))
    return 2 if failed else 0


def _show(console, path: Path, recording: Recording) -> None:
    import numpy as np
    from rich.table import Table

    from servo_twin.recording.recording import COLUMNS

    said = [f'{recording.duration:.6g} s at {1.0 / recording.period:.6g} Hz',
            f'{len(recording)} samples from number {recording.sequence}',
            f'servo {recording.servo or "not said"}',
            f'family {recording.family or "not said"}',
            f'replicate {recording.replicate or "not said"}']
    table = Table(title=str(path), title_justify='left', title_style='bold',
                  caption=', '.join(said), caption_justify='left')
    table.add_column('channel')
    table.add_column('unit')
    for heading in ('min', 'max', 'mean', 'missing'):
        table.add_column(heading, justify='right')
    for name, unit in COLUMNS.items():
        column = recording[name]
        known = column[np.isfinite(column)]
        if len(known):
            lost = len(column) - len(known)
            table.add_row(name, unit, f'{known.min():.6g}', f'{known.max():.6g}',
                          f'{known.mean():.6g}', str(lost) if lost else '')
        else:
            table.add_row(name, unit, 'not measured', style='dim')
    console.print(table)
    if recording.note:
        console.print(f'note: {recording.note}', markup=False)
    for warning in recording.warnings:
        console.print(f'warning: {warning}', markup=False, style='yellow')
    console.print(f'sha256 {recording.digest}', style='dim')
