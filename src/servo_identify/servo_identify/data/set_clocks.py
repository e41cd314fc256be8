"""Times that a clock cannot have told unless it was set, and what to do about them."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np

MOST_HOLES = 1000
"""Samples of the grid for one row beyond which a clock has jumped, and not the logger paused."""

HOUR = 3600.0
"""By how much a clock is set where daylight saving begins or ends, s."""

COUNTERS = (15, 16, 24, 31, 32)
"""
Bits of a counter of time that wraps around.

That of Dynamixel has 15, `millis` of Arduino has 32, and 31 where it is held with a sign.
"""

_UNITS = (1.0, 1e-3, 1e-6)  # s, of one count


def check_jumps(path: Path, time: np.ndarray, step: float, skipped: tuple[int, float]) -> None:
    """
    Raise ValueError where rising times, s, on a grid of ``step`` s leap as no pause of a logger.

    ``skipped`` are the rows that were left out before the first time, and the s that they last.
    """
    rows, before = skipped
    k = int(np.argmax(np.diff(time)))
    leap = (f'time jumps from {time[k]:.9g} s in row {rows + k + 1} to {time[k + 1]:.9g} s in '
            f'row {rows + k + 2}')
    inside = before + (time[k] + time[k + 1]) / 2.0 - time[0]
    choice = f'take one side of it (--to {inside:.6g} or --from {inside:.6g}), or '
    if abs(time[k + 1] - time[k] - HOUR) < 2.0 * step:
        raise ValueError(f'{path}: {leap}. The clock was set forward by an hour there, as '
                         f'daylight saving does: {choice}subtract {HOUR:g} s from the times '
                         'behind it, or export them in UTC')
    if (time[-1] - time[0]) / step > MOST_HOLES * len(time):
        raise ValueError(f'{path}: {len(time)} rows {step:.6g} s apart last '
                         f'{time[-1] - time[0]:.6g} s: {leap}. {choice.capitalize()}mend the '
                         'clock')


def check_order(path: Path, time: np.ndarray) -> None:
    """Raise ValueError for times that are no numbers, or run backwards."""
    bad = np.flatnonzero(~np.isfinite(time))
    if len(bad):
        raise ValueError(f'{path}: t = {time[bad[0]]} in row {bad[0] + 1}; every row needs a '
                         f'time, and {len(bad)} of {len(time)} have none: delete these rows, or '
                         'fill their times in')
    back = np.flatnonzero(np.diff(time) < 0.0)
    if len(back):
        k = back[0]
        raise ValueError(f'{path}: time runs backwards from {time[k]:.9g} s in row {k + 1} to '
                         f'{time[k + 1]:.9g} s in row {k + 2}. ' + _advice(time, back))


def _advice(time: np.ndarray, back: np.ndarray) -> str:
    """Say what to do where times run backwards behind some rows."""
    last, first, step = time[back[0]], time[back[0] + 1], float(np.median(np.abs(np.diff(time))))
    for bits, unit in product(COUNTERS, _UNITS):
        if 0.0 <= first < 2.0 * step and 0.0 <= 2**bits * unit - last < 2.0 * step:
            return (f'The counter of {bits} bit wrapped around there: map the time with '
                    f'wraps: {2**bits}')
    if abs(last - first - HOUR) < 2.0 * step:
        return (f'The clock was set back by an hour there, as daylight saving does: add '
                f'{HOUR:g} s to the times behind it, or export them in UTC')
    if len(back) == 1 and first <= time[0]:
        return 'A second recording begins there: cut the file'
    return 'Sort the rows by their time, or cut the file where rows were written twice'
