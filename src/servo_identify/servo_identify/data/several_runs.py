"""
Several recordings in one file: episodes below each other, or groups beside each other.

LeRobot numbers the episodes of a Parquet file in a column, ``episode_index``; robomimic keeps each
demonstration in a group of HDF5, ``data/demo_0``. They were not recorded in one go, whatever their
times say: each is a recording of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
import re
from typing import Any

import numpy as np

from .column_names import looks_like
from .run_labels import COLUMN, WORDS
from .table import Table

_GROUP = re.compile(rf'(?:.*\.)?((?:{WORDS})_?\d+)\.(.+)', re.IGNORECASE)
FEWEST = 2  # rows of a recording
PAUSE = 10.0  # periods, after which a logger that wrote its names again was started again
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
        return [_rows(table, first, end, f'{word}_{number:g}')
                for number, first, end in zip(numbers, starts, ends, strict=True)]
    return [table]


def cut_before(table: Table, rows: Sequence[int]) -> list[Table]:
    """
    Return the runs that a logger began at some rows of a table; the table where it went on.

    They are called ``run_1`` ... Where times rise over all rows, those begin a run before which
    the logger paused; else all do.
    """
    rising = next((steps for name, column in table.columns.items() if looks_like(name) == 't'
                   and np.all((steps := np.diff(column)) >= 0.0) and column[-1] > column[0]), None)
    what = 'begin again'
    if rising is not None:
        pause, what = PAUSE * np.median(rising[rising > 0.0]), 'pause'
        rows = [row for row in rows if rising[row - 1] > pause]
        if not rows:
            return [table]
    count = len(next(iter(table.columns.values()), ()))
    said = (*table.warnings, f'the times {what} there: each is a recording of its own')
    return [replace(_rows(table, first, end, f'run_{number}'), warnings=said if not first else ())
            for number, (first, end) in enumerate(pairwise([0, *rows, count]), 1)]


def _rows(table: Table, first: int, end: int, run: str) -> Table:
    """Return some rows of a table as a run of it; when other rows than the first were is lost."""
    return replace(table, run=run, begins=table.begins if not first else dict.fromkeys(
        table.begins, ''), columns={one: held[first:end] for one, held in table.columns.items()})


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
