"""
Uneven times brought onto an even grid.

A recording has one period. Times that follow one within a hundredth of it are taken as even and
the values stay as they are, to the last bit. So do those of each row that lies on the grid where
others do not. What lies between rows is made up: measurements linearly between their neighbours,
held commands (voltage and references) by their mean until the next sample. Across a hole of more
than three periods nothing is made up: those rows are NaN.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from servo_twin.recording.recording import RESAMPLED

from .between_rows import BetweenRows
from .joining import HELD
from .packed import stem_of
from .rows_in_time import held_over, HOLE, in_holes
from .set_clocks import check_jumps, check_order
from .stretch import ALL, Stretch

EVEN = 0.01
"""Periods that a time may lie off the even grid."""

MOST_ON_GRID = 0.5
"""Share of the rows that lie on a grid where the logger has it, and not by chance."""

FEW = 0.01
"""Share of the rows that may be made up of a recording that counts as even."""

MOST_REPEATED = 0.5
"""Share of the rows that may repeat a time and are left out; of more too little would be left."""

STAMPED = 1e7
"""First time, s, from which on it is a stamp of a calendar: no machine runs for so long."""

_AT_ONCE = 100_000  # samples whose places are looked up together


def even(path: Path, columns: dict[str, np.ndarray], period: float,
         warnings: list[str], stretch: Stretch = ALL
         ) -> tuple[float, float, dict[str, np.ndarray]]:
    """
    Return (start, period, columns without ``t``) on an even grid.

    ``period``: s, of the grid; 0 takes it from the times. ``stretch`` is what is wanted of the
    rows. Raises ValueError for times that are not numbers or run backwards, for less than two
    samples, where too many times repeat, and for an empty stretch. Says in ``warnings`` what it
    changed.
    """
    time = columns['t']
    rest = {name: column for name, column in columns.items() if name != 't'}
    check_order(path, time)
    repeated = np.flatnonzero(np.diff(time) == 0.0) + 1
    if len(repeated):
        if len(repeated) > MOST_REPEATED * len(time):
            raise ValueError(
                f'{path}: {len(repeated)} of {len(time)} rows repeat the time of the row before, '
                f'and {MOST_REPEATED:.0%} may at most: '
                + ('the stamps are of whole seconds alone' if (time == np.round(time)).all() else
                   'the stamps are coarser than the rows')
                + '. Write the time with more digits; or count the rows in their period: time: '
                '{every: 0.002} in a mapping file, t=:2 ms of init')
        warnings.append(f'{len(repeated)} rows repeat the time of the row before, the first is '
                        f'row {repeated[0] + 1} at {_told(time[repeated[0]], time[0])}; they are '
                        'left out')
        time = np.delete(time, repeated)
        rest = {name: np.delete(column, repeated) for name, column in rest.items()}
    first, end = stretch.rows(stem_of(path), time)
    skipped = first, float(time[first] - time[0])
    time, rest = time[first:end], {name: column[first:end] for name, column in rest.items()}
    between_rows = BetweenRows()
    between_rows.add({'t': time, **rest})
    step, follow = grid_of(path, time, period, warnings, between_rows.sentence(), skipped)
    if follow:
        return float(time[0]), step, rest
    between = Between(time, step)
    between.tell_holes(warnings)
    return float(time[0]), step, between.values(rest, 0, 0, between.samples)


def _told(at: float, first: float) -> str:
    """Return an instant, s; that of a stamp of years as what lies since the first one."""
    return f't = {at:.9g} s' if first < STAMPED else f'{at - first:.6g} s after the first row'


def grid_of(path: Path, time: np.ndarray, period: float, warnings: list[str],
            cost: str = '', skipped: tuple[int, float] = (0, 0.0)) -> tuple[float, bool]:
    """
    Return the step, s, of the grid of rising times, and whether they follow it as they are.

    ``period`` and ``warnings`` as of :func:`even`; ``cost`` is said where they do not follow it,
    ``skipped`` are the rows that were left out before the first time, and the s that they last.
    Raises ValueError for less than two times.
    """
    if len(time) < 2:
        raise ValueError(f'{path} has {len(time)} samples; a recording needs two')
    own = own_period(time[0], time[-1], len(time))
    if fits(own, period, len(time)) and follows(time, time[0], own, 0):
        return period or own, True
    step = period or _usual(time)
    shortest, longest = np.diff(time).min(), np.diff(time).max()
    check_jumps(path, time, step, skipped)
    samples = int((time[-1] - time[0]) / step * (1.0 + 1e-12) + EVEN) + 1
    made_up = samples - int(on_grid(time, step).sum()) - in_holes(time, step)
    how = f'measurements linearly, commands by the mean of what they hold{cost}'
    if 0 < made_up <= FEW * samples:
        warnings.append(f'{100.0 * made_up / samples:.2g} % of the rows ({made_up} of {samples}) '
                        f'are missing or off the grid of {step:.6g} s: they are made up between '
                        f'their neighbours, {how}')
    elif made_up > 0:
        warnings.append(f'times are not even ({shortest:.6g} to {longest:.6g} s apart): '
                        f'{RESAMPLED} {step:.6g} s, {how}')
    return step, False


def own_period(first: float, last: float, samples: int) -> float:
    """Return the period, s, of so many even times."""
    return round_period((last - first) / (samples - 1), samples)


def fits(own: float, wanted: float, samples: int) -> bool:
    """Tell whether samples of a period, s, can be taken for those of the wanted one; 0: any."""
    return not wanted or abs(wanted - own) * samples <= EVEN * own


def follows(time: np.ndarray, start: float, period: float, first: int) -> bool:
    """Tell whether times are those of the samples from number ``first`` on of an even grid."""
    grid = period * np.arange(first, first + len(time))
    return bool(np.abs(time - start - grid).max() / period <= EVEN)


def round_period(mean: float, samples: int) -> float:
    """Return the shortest decimal that is the period within what the times can tell."""
    for digits in range(1, 12):
        short = float(f'{mean:.{digits - 1}e}')
        if abs(short - mean) * samples <= 0.1 * EVEN * mean:
            return short
    return mean


def on_grid(time: np.ndarray, step: float) -> np.ndarray:
    """Return which times lie on the grid of a step, s, that begins with the first; (rows,)."""
    place = (time - time[0]) / step
    near = np.abs(place - np.round(place)) <= EVEN
    return near if near.mean() >= MOST_ON_GRID else np.zeros(len(time), dtype=bool)


def _usual(time: np.ndarray) -> float:
    """Return the period, s, of uneven times: a round one that is meant, else their median."""
    median = float(np.median(np.diff(time)))
    steps = np.maximum(np.round(np.diff(time) / median), 1.0)
    mean = float((time[-1] - time[0]) / steps.sum())
    if abs(mean / median - 1.0) >= 0.03:
        return median
    meant = float(f'{mean:.1e}')
    return meant if abs(meant / mean - 1.0) < 1e-3 else round_period(mean, int(steps.sum()))


class Between:
    """
    The samples of an even grid, each between two rows of uneven times.

    ``time``: s, of all rows, rising; ``step``: s, of the grid, which begins with the first row.
    """

    def __init__(self, time: np.ndarray, step: float) -> None:
        grid = time[0] + step * np.round((time - time[0]) / step)
        self.time = np.where(on_grid(time, step), grid, time)
        self.step = step
        self.samples = int((self.time[-1] - self.time[0]) / step * (1.0 + 1e-12)) + 1
        self._hole = HOLE * max(step, float(np.median(np.diff(time)))) * (1.0 + 1e-6)

    def row(self, sample: int) -> int:
        """Return the number of the first row that is needed from a sample on."""
        return max(int(self._places(sample, sample + 1)[1][0]) - 1, 0)

    def known(self, rows: int) -> int:
        """Return how many samples lie between the first so many rows."""
        if rows >= len(self.time):
            return self.samples
        return max(int((self.time[rows - 1] - self.time[0]) / self.step) - 1, 0) if rows else 0

    def values(self, columns: dict[str, np.ndarray], row: int, first: int, end: int
               ) -> dict[str, np.ndarray]:
        """Return samples ``first`` to ``end`` of columns that begin with a row."""
        grid, _, hole = self._places(first, end)
        result = {}
        for name, column in columns.items():
            time = self.time[row:row + len(column)]
            value = (held_over(grid, self.step, time, column) if name in HELD else
                     np.interp(grid, time, column))
            result[name] = np.where(hole, np.nan, value)
        return result

    def tell_holes(self, warnings: list[str]) -> None:
        """Say how many samples lie in holes, and where the first of them is."""
        count, at = 0, np.nan
        for first in range(0, self.samples, _AT_ONCE):
            grid, _, hole = self._places(first, min(first + _AT_ONCE, self.samples))
            if hole.any() and not count:
                at = grid[hole][0]
            count += int(hole.sum())
        if count:
            warnings.append(f'{count} rows lie in holes of more than {HOLE:g} periods, the '
                            f'first at {_told(at, self.time[0])}; they are NaN')

    def _places(self, first: int, end: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the times of samples, the last row before each, and whether it is in a hole."""
        time, step = self.time, self.step
        grid = time[0] + step * np.arange(first, end)
        last = np.clip(np.searchsorted(time, grid + 1e-9 * step, 'right') - 1, 0, len(time) - 1)
        following = np.minimum(last + 1, len(time) - 1)
        hole = (time[following] - time[last] > self._hole) & (grid > time[last] + 1e-9 * step)
        return grid, last, hole
