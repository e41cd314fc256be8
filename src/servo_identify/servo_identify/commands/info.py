"""Say what bags hold: duration, rate, channels with their ranges, family, gaps, warnings."""

from __future__ import annotations

import argparse
import sys
from typing import Any, TYPE_CHECKING

from servo_twin.commands.terminal import tell, terminal

from ..data.arguments import add_data, files, stretch_of

if TYPE_CHECKING:
    from rich.console import Console


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    add_data(parser, servo=False)


def main(arguments: argparse.Namespace) -> int:
    """Print a table a bag; 2 when one of them cannot be read, after the others."""
    from ..data.reading import open_all
    from ..data.recording_facts import facts_of

    console = terminal(quiet=arguments.quiet)
    failed, found = list[str](), []
    for named in arguments.bags:
        try:
            for path in files([named]):
                with open_all(path, None, arguments.mapping, arguments.namespace,
                              stretch=stretch_of(arguments)) as several:
                    for recording in several:
                        facts = facts_of(path, recording)
                        _show(console, facts)
                        found.append(facts)
        except (ValueError, OSError) as error:
            print(f'servo-identify info: {error}', file=sys.stderr)
            failed.append(str(error))
    tell(arguments, recordings=found, **({'error': '; '.join(failed)} if failed else {}))
    return 2 if failed else 0


def _show(console: Console, facts: dict[str, Any]) -> None:
    from rich.table import Table

    from servo_twin.recording.recording import COLUMNS

    said = [f'{facts["duration"]:.6g} s at {1.0 / facts["period"]:.6g} Hz',
            f'{facts["samples"]} samples from number {facts["sequence"]}',
            *(f'{name} {facts[name] or "not said"}' for name in ('servo', 'family', 'replicate'))]
    table = Table(title=facts['path'], title_justify='left', title_style='bold',
                  caption=', '.join(said), caption_justify='left')
    table.add_column('channel')
    table.add_column('unit')
    for heading in ('min', 'max', 'mean', 'missing'):
        table.add_column(heading, justify='right')
    for name, unit in COLUMNS.items():
        one = facts['channels'].get(name)
        if one:
            table.add_row(name, unit, f'{one["min"]:.6g}', f'{one["max"]:.6g}',
                          f'{one["mean"]:.6g}', str(one['missing'] or ''))
        else:
            table.add_row(name, unit, 'not measured', style='dim')
    console.print(table)
    if facts['note']:
        console.print(f'note: {facts["note"]}', markup=False)
    for warning in facts['warnings']:
        console.print(f'warning: {warning}', markup=False, style='yellow')
    if facts['sha256']:
        console.print(f'sha256 {facts["sha256"]}', style='dim')
