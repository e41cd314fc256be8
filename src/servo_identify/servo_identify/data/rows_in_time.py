"""Columns that were sampled at times of their own, brought to the same rows."""

from __future__ import annotations

import re

import numpy as np

HOLE = 3.0
"""Periods between two samples beyond which nothing is interpolated."""


_NUMBERED = re.compile(r'(t|time|x_value|zeit)(?: \((\d+)\)|[ _]?\d+)( \[[^\]]*\])?',
                       re.IGNORECASE)
"""A column of times that is there more than once: by csv_layout.py, or as t1, t2."""
_ALIKE = 1e-3  # periods within which two times are one


def at_rows(rows: np.ndarray, times: np.ndarray, values: np.ndarray, ahead: float = 0.0,
            usual: float = 0.0) -> np.ndarray:
    """
    Return values that were taken at other times at the times of the rows, s.

    NaN before the first of them. Values that are held till the next have ``ahead``: the period of
    the rows, s, over which :func:`held_over` takes their mean. Others are interpolated, and NaN
    after the last one and in holes of more than three of their periods. ``usual`` is that period,
    s, of the whole where these are a part; 0 takes it from the times.
    """
    if not len(times):
        return np.full(len(rows), np.nan)
    order = np.argsort(times, kind='stable')
    times, values = times[order], values[order]
    if ahead:
        return np.where(rows < times[0], np.nan, held_over(rows, ahead, times, values))
    last = np.searchsorted(times, rows, 'right') - 1
    found = np.interp(rows, times, values, left=np.nan, right=np.nan)
    usual = usual or period_between(times)
    if len(times) > 1:
        last = np.clip(last, 0, len(times) - 2)
        gap = times[last + 1] - times[last]
        found[(gap > HOLE * usual) & (rows > times[last])
              & (rows < times[last + 1])] = np.nan
    return found


def held_over(rows: np.ndarray, ahead: float, times: np.ndarray, values: np.ndarray
              ) -> np.ndarray:
    """
    Return the mean of held values over ``ahead`` s from each row on.

    A twin holds the value of a row till the next. The last value before a row would act late by
    as much as the times are apart from the rows. Where a value is NaN, it is the last before.
    """
    first = np.clip(np.searchsorted(times, rows + 1e-9 * ahead, 'right') - 1, 0, None)
    last = np.maximum(np.searchsorted(times, rows + ahead * (1.0 - 1e-9), 'right') - 1, first)
    mean, ends = np.zeros(len(rows)), np.append(times[1:], np.inf)
    for one in range(int((last - first).max(initial=0)) + 1):
        at = np.minimum(first + one, last)
        lasts = np.minimum(ends[at], rows + ahead) - (rows if not one else times[at])
        mean += np.where(first + one <= last, values[at] * (lasts / ahead), 0.0)
    return np.where((last == first) | np.isnan(mean), values[first], mean)


def period_between(times: np.ndarray) -> float:
    """Return the usual time between two samples, s; inf where there are too few to tell."""
    return float(np.median(np.diff(times))) if len(times) > 2 else np.inf


def timelines_of(names: list[str]) -> dict[str, list[str]]:
    """
    Return the columns of each of several times: those that stand between it and the next.

    A scope that samples in several tasks writes such a table: ``time (1)``, ``u``, ``time (2)``,
    ``i``. Empty where there are no two times with columns, or the first column is no time.
    """
    found = dict[str, list[str]]()
    for name in names:
        if _NUMBERED.fullmatch(name):
            found[name] = []
        elif not found:
            return {}
        else:
            found[next(reversed(found))].append(name)
    return found if len(found) > 1 and all(found.values()) else {}


def on_one_timeline(columns: dict[str, np.ndarray], warnings: list[str]) -> dict[str, np.ndarray]:
    """
    Return columns of several times with those of the time that has most rows.

    Times that are the same are joined as they are. Columns of another time are interpolated, which
    ``warnings`` say. Times in different units are left as they are.
    """
    lines = timelines_of(list(columns))
    units = {match[3] for name in lines if (match := _NUMBERED.fullmatch(name))}
    own = [columns[name] for name in lines
           if (match := _NUMBERED.fullmatch(name)) and not match[2]]
    if len(units) != 1 or not all(np.nanmin(np.diff(one), initial=0.0) >= 0.0 for one in own):
        return columns  # t1 may also be a temperature
    leading = max(lines, key=lambda name: np.isfinite(columns[name]).sum())
    rows = columns[leading]
    rows = rows[np.isfinite(rows)]
    near = _ALIKE * period_between(rows)
    first = _NUMBERED.fullmatch(leading)
    assert first is not None
    found = {f'{first[1]}{first[3] or ""}': rows}
    for time, names in lines.items():
        known = np.isfinite(columns[time])
        own = columns[time][known]
        same = len(own) == len(rows) and bool(np.abs(own - rows).max(initial=0.0) <= near)
        for name in names:
            values = columns[name][known]
            found[name] = values if same else at_rows(rows, own, values)
        if not same and names:
            warnings.append(f'{names} have times of their own ({time!r}): they are interpolated '
                            f'at those of {leading!r}')
    return found


def in_holes(time: np.ndarray, step: float) -> int:
    """Return how many samples of a grid of a step, s, lie in holes between rising times."""
    gaps = np.diff(time) / step
    wide = gaps > HOLE * max(1.0, float(np.median(gaps))) * (1.0 + 1e-6)
    return int((np.ceil(gaps[wide] - 0.5) - 1.0).sum())
