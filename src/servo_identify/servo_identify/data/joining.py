"""Tables whose rows belong to several topics, brought to the rows of one of them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from .rows_in_time import at_rows, period_between
from .table import Table

HELD = ('voltage', 'current_reference', 'reference_position', 'reference_velocity',
        'added_command')
"""Columns that hold from their sample to the next."""

def joined(table: Table, time: str, leading: str, used: Collection[str],
           held: Collection[str]) -> Table:
    """
    Return a table whose rows belong to several topics, with the rows of one of them.

    Such a table (PlotJuggler's) has a row for each message of any topic and leaves the columns of
    the others empty. ``leading`` is a column of the topic that gives the rows.
    """
    times, rows = table[time], table[time][np.isfinite(table[leading])]
    columns, ahead = {time: rows}, period_between(rows)
    for name in used:
        if name != time:
            known = np.isfinite(table[name])
            columns[name] = at_rows(rows, times[known], table[name][known],
                                    ahead if name in held else 0.0)
    return replace(table, columns=columns)
