"""What happened beside the samples, as a table: faults, timeouts, changes, notes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rich.table import Table
from rich.text import Text

from ..recording.events import Happened

WORDS = {'began': 'twin began', 'parameters': 'parameter', 'servo_file': 'servo file',
         'settings': 'setting', 'trouble': 'trouble', 'over': 'over', 'note': 'note',
         'change': 'change detected', 'place': 'place of the change'}
"""How people call the kinds of Event.msg."""


@dataclass(frozen=True)
class Row:
    """One line: seconds from the first sample, who told, what it is, in one sentence."""

    at: str
    source: str
    kind: str
    text: str


def rows_of(happened: Iterable[Happened], start: float) -> list[Row]:
    """
    Return lines in the order of time; ``start`` is that of the first sample, s since 1970.

    A trouble that was over before the first sample is left out.
    """
    events = sorted(happened, key=lambda one: one.time)
    before = {(one.source, one.text) for one in events if one.kind == 'over' and one.time < start}
    return [Row(f'{one.time - start:.2f}', one.source, WORDS.get(one.kind, one.kind), one.text)
            for one in events if one.time >= start or (one.source, one.text) not in before]


def event_table(happened: Iterable[Happened], start: float) -> Table:
    """Return the table for the terminal; arguments as of :func:`rows_of`."""
    table = Table(title='what happened', title_justify='left', title_style='bold')
    table.add_column('s', justify='right')
    for column in ('told by', 'what', ''):
        table.add_column(column)
    for row in rows_of(happened, start):
        table.add_row(row.at, row.source, row.kind, Text(row.text))
    return table
