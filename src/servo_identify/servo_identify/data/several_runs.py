"""
Several recordings in one file: episodes below each other, or groups beside each other.

LeRobot numbers the episodes of a Parquet file in a column, ``episode_index``; robomimic keeps each
demonstration in a group of HDF5, ``data/demo_0``. They were not recorded in one go, whatever their
times say: each is a recording of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
import re
from typing import Any

import numpy as np

from .column_names import looks_like
from .run_labels import COLUMN, WORDS
from .table import Table

_GROUP = re.compile(rf'(?:.*\.)?((?:{WORDS})_?\d+)\.(.+)', re.IGNORECASE)
FEWEST = 2  # rows of a recording
_FLAGS = ('run', 'demo')
"""Names that may also say whether something is switched on."""


def runs_of(table: Table) -> list[Table]:
    """
    Return the runs of a table, in the order of its rows; the table itself where it holds one.

    A column that is called ``episode_index`` or the like tells them apart: whole numbers, each in
    rows that follow each other. Each run has the name ``episode_3`` in :attr:`.Table.run`.
    """
    for name, column in table.columns.items():
        match = COLUMN.fullmatch(name)
        if match is None or not np.array_equal(column, np.round(column)):
            continue
        starts = np.flatnonzero(np.diff(column, prepend=np.nan) != 0.0)
        numbers = column[starts]
        if not 1 < len(numbers) == len(set(numbers)) or name.lower() in _FLAGS and 0.0 in numbers:
            continue
        ends = [*starts[1:], len(column)]
        word = match[1].lower()
        return [replace(table, run=f'{word}_{number:g}', begins=table.begins if not first else {},
                        columns={one: held[first:end] for one, held in table.columns.items()})
                for number, first, end in zip(numbers, starts, ends, strict=True)]
    return [table]


def goes_on(table: Table) -> bool:
    """Tell whether the times of a table rise over all of its rows; row numbers tell as much."""
    return any(looks_like(name) == 't' and bool(np.all(np.diff(column) >= 0.0))
               and column[-1] > column[0] for name, column in table.columns.items())


def cut_before(table: Table, rows: Sequence[int]) -> list[Table]:
    """Return the runs of a table that begin with its first row and with others; ``run_1`` ..."""
    starts = [0, *rows]
    count = len(next(iter(table.columns.values()), ()))
    said = (*table.warnings, 'the times begin again there: each is a recording of its own')
    return [replace(table, run=f'run_{number}', begins=table.begins if not first else {},
                    warnings=said if not first else (),
                    columns={one: held[first:end] for one, held in table.columns.items()})
            for number, (first, end) in enumerate(zip(starts, [*rows, count], strict=True), 1)]


def long_enough(runs: Sequence[Table]) -> tuple[list[Table], dict[str, str]]:
    """
    Return the runs that have the rows of a recording, and what is said of the others, by run.

    One run alone stays, for what reads it to refuse, and so does the last where none has them.
    """
    rows = [len(next(iter(one.columns.values()), ())) for one in runs]
    if max(rows) < FEWEST:
        return [*runs[-1:]], {}
    short = {one.run: f'{one.path.name}: {one.run} has {count} row{"s" * (count != 1)} and is '
             f'left out; a recording needs {FEWEST}'
             for one, count in zip(runs, rows, strict=True) if count < FEWEST}
    return [one for one in runs if one.run not in short], short


def groups_of(arrays: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """
    Return the arrays of each run by its name, by their names within it; '' where there is one.

    Groups that are called ``demo_0``, ``demo_1`` or the like are runs where they hold the same.
    What stands beside the groups is in each.
    """
    groups, beside = dict[str, dict[str, Any]](), dict[str, Any]()
    for name, value in arrays.items():
        match = _GROUP.fullmatch(name)
        if match:
            groups.setdefault(match[1], {})[match[2]] = value
        else:
            beside[name] = value
    if len({frozenset(inner) for inner in groups.values()}) != 1 or len(groups) < 2:
        return {'': dict(arrays)}
    ordered = sorted(groups, key=lambda name: int(re.findall(r'\d+', name)[-1]))
    return {name: beside | groups[name] for name in ordered}
