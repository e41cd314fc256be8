"""Tables whose rows stand newest first, as a history or a database lists them, turned round."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .table import Table

SAID = 'its rows stand newest first, as its time falls throughout: they are read from the last on'


def oldest_first(table: Table, time: str) -> Table:
    """
    Return a table with its last row first where its time falls throughout, with a warning.

    ``time`` is the column of the time. Times may stay for some rows. When the first row was taken
    is not known then, but of times since 1970.
    """
    steps = np.diff(table.columns.get(time, np.empty(0)))
    if not len(steps) or not np.all(steps <= 0.0) or np.mean(steps < 0.0) <= 0.5:
        return table
    return replace(table, columns={name: column[::-1] for name, column in table.columns.items()},
                   begins=dict.fromkeys(table.begins, ''), warnings=(*table.warnings, SAID))
