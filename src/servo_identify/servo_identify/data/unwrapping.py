"""Angles of encoders that wrap around, put together, and where turns of them may be lost."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .rows_in_time import HOLE

SAFE = 1.0 / 3.0
"""Share of the round that an angle may turn between two rows; beyond a half it is lost."""

_ENDS = 0.9  # of the range of the numbers: a jump from end to end
_SHORT = 0.6  # of a round, within which the numbers of another round lie


def unwrapped(column: np.ndarray, turn: float) -> np.ndarray:
    """Return numbers (rows,) that wrap around after ``turn`` as one line; NaN stay."""
    known = np.isfinite(column)
    line = column.copy()
    line[known] = np.unwrap(column[known], period=turn)
    return line


def doubts(name: str, time: np.ndarray, column: np.ndarray, turn: float) -> Iterator[str]:
    """
    Yield what speaks against the ``turn`` of a column, and where whole turns may be lost.

    ``time`` s and ``column`` (rows,) are as they were recorded, in the unit of ``turn``.
    """
    known = np.isfinite(column) & np.isfinite(time)
    raw, at = column[known], time[known]
    if len(raw) < 3:
        return
    span = float(np.ptp(raw))
    if span < _SHORT * turn and np.any(np.abs(np.diff(raw)) > _ENDS * span):
        yield (f'{name}: its numbers lie between {raw.min():g} and {raw.max():g} and jump from '
               f'end to end, and wraps is {turn:g}: is the round {span + 1.0:g} or so?')
        return
    step, gap = np.diff(np.unwrap(raw, period=turn)), np.diff(at)
    usual = float(np.median(gap))
    before = np.abs(np.append(0.0, step[:-1])) / np.maximum(np.append(usual, gap[:-1]), usual)
    turned = np.where(gap > HOLE * usual, before * gap, np.abs(step))
    far = np.flatnonzero(turned > SAFE * turn)
    if len(far):
        yield (f'{name}: it turns by more than a third of its round, {turn:g}, since the row '
               f'before in {len(far)} rows, first at t = {at[far[0] + 1]:.9g} s: whole turns may '
               'be lost there. Record faster, or cut the table there')
