"""Columns that were sampled at times of their own, brought to the same rows."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from .tables import Table

HELD = ('voltage', 'current_reference', 'reference_position', 'reference_velocity',
        'added_command')
"""Columns that hold from their sample to the next."""

HOLE = 3.0
"""Periods between two samples beyond which nothing is interpolated."""


def at_rows(rows: np.ndarray, times: np.ndarray, values: np.ndarray, held: bool,
            usual: float = 0.0) -> np.ndarray:
    """
    Return values that were taken at other times at the times of the rows, s.

    NaN before the first of them. ``held`` values stay till the next; others are interpolated, and
    NaN after the last one and in holes of more than three of their periods. ``usual`` is that
    period, s, of the whole where these are a part; 0 takes it from the times.
    """
    if not len(times):
        return np.full(len(rows), np.nan)
    order = np.argsort(times, kind='stable')
    times, values = times[order], values[order]
    last = np.searchsorted(times, rows, 'right') - 1
    if held:
        return np.where(last < 0, np.nan, values[np.maximum(last, 0)])
    found = np.interp(rows, times, values, left=np.nan, right=np.nan)
    usual = usual or period_between(times)
    if len(times) > 1:
        last = np.clip(last, 0, len(times) - 2)
        gap = times[last + 1] - times[last]
        found[(gap > HOLE * usual) & (rows > times[last])
              & (rows < times[last + 1])] = np.nan
    return found


def period_between(times: np.ndarray) -> float:
    """Return the usual time between two samples, s; inf where there are too few to tell."""
    return float(np.median(np.diff(times))) if len(times) > 2 else np.inf


def joined(table: Table, time: str, leading: str, used: Collection[str],
           held: Collection[str]) -> Table:
    """
    Return a table whose rows belong to several topics, with the rows of one of them.

    Such a table (PlotJuggler's) has a row for each message of any topic and leaves the columns of
    the others empty. ``leading`` is a column of the topic that gives the rows.
    """
    times, rows = table[time], table[time][np.isfinite(table[leading])]
    columns = {time: rows}
    for name in used:
        if name != time:
            known = np.isfinite(table[name])
            columns[name] = at_rows(rows, times[known], table[name][known], name in held)
    return replace(table, columns=columns)
