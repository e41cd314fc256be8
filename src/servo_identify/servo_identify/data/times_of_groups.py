"""Groups of arrays that each have times of their own, brought to the rows of one of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .column_names import looks_like, split
from .rows_in_time import at_rows, period_between

_ALIKE = 1e-3  # periods within which two times are one
_TIME = 'time'


def on_rows_of_one(columns: Mapping[str, np.ndarray], warnings: list[str]
                   ) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """
    Return columns on the times of most rows and columns, and why others cannot be brought there.

    ``motor.time`` is the time of all that begins with ``motor.``. Columns with other times are
    interpolated, which ``warnings`` say; equal times are joined as they are. A time in another
    unit, or that has nothing in common with the rows, keeps its columns out.
    """
    times = {name.rpartition('.')[0]: name for name, column in columns.items() if _is_time(
        name, column)}
    if len(times) < 2:
        return dict(columns), {}
    owners = [_time_of(name, times) for name in columns]
    leading = max(times.values(), key=lambda one: (len(columns[one]), owners.count(one)))
    rows, unit = columns[leading], split(leading)[1]
    called = leading if looks_like(leading) == 't' else _TIME
    found, refused = dict[str, np.ndarray](), dict[str, str]()
    parted = dict[str, list[str]]()
    for name, column in columns.items():
        own = _time_of(name, times)
        if own in (leading, ''):
            found[called if name == leading else name] = column
        elif _same(columns[own], rows):
            if name != own or looks_like(name) == 't':
                found[name] = column
        elif name != own:
            if len(column) != len(columns[own]):
                refused[name] = (f'{name!r} has {len(column)} rows and its time {own!r} '
                                 f'{len(columns[own])}')
            elif split(own)[1] != unit or not _overlap(columns[own], rows):
                refused[name] = (
                    f'{name!r} has times of its own, {_span(own, columns[own])}, and most have '
                    f'{_span(leading, rows)}: bring both to one clock and unit')
            else:
                found[name] = at_rows(rows, columns[own], column)
                parted.setdefault(own, []).append(name)
    warnings += [f'{names} have times of their own ({own!r}): they are interpolated at those of '
                 f'{leading!r}' for own, names in parted.items()]
    return found, refused


def _is_time(name: str, column: np.ndarray) -> bool:
    """Tell whether the last part of a name is that of a time, and the numbers rise."""
    last = name.rpartition('.')[2]
    return looks_like(last) == 't' and len(column) > 1 and bool(
        np.all(np.diff(column) >= 0.0)) and column[-1] > column[0]


def _time_of(name: str, times: Mapping[str, str]) -> str:
    """Return the time of the nearest group that a column is in; '' for none."""
    above = name
    while above:
        above = above.rpartition('.')[0]
        if above in times:
            return times[above]
    return ''


def _same(times: np.ndarray, rows: np.ndarray) -> bool:
    return len(times) == len(rows) and bool(
        np.abs(times - rows).max() <= _ALIKE * period_between(rows))


def _overlap(times: np.ndarray, rows: np.ndarray) -> bool:
    return bool(times[0] < rows[-1] and rows[0] < times[-1])


def _span(name: str, times: np.ndarray) -> str:
    return f'{name!r} of {times[0]:.12g} to {times[-1]:.12g}'
