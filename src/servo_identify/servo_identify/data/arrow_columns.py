"""Columns of Arrow as numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

_HELD = 2**52  # whole numbers up to here float64 holds, and their differences


def numbers_of(column: Any, zero: int = 0) -> np.ndarray | None:
    """
    Return a column as float64, stamps and durations in s; None for what may be text.

    ``zero`` is taken off whole numbers.
    """
    from pyarrow import types

    kind = column.type
    if types.is_null(kind):
        return np.full(len(column), np.nan)
    if types.is_timestamp(kind):
        return _seconds(column)
    if types.is_duration(kind):
        return np.asarray(column.to_numpy() / np.timedelta64(1, 's'))
    if types.is_integer(kind):
        return _whole(column, zero)
    if types.is_floating(kind) or types.is_boolean(kind):
        return np.asarray(column.cast('float64').to_numpy())
    return None


def _seconds(column: Any) -> np.ndarray:
    """Return stamps as s since the first of them."""
    from pyarrow import timestamp

    counts = column.cast(timestamp('ns', column.type.tz)).cast('int64').to_pylist()
    first = next((one for one in counts if one is not None), 0)
    return np.array([np.nan if one is None else (one - first) * 1e-9 for one in counts])


def first_stamp(column: Any) -> str:
    """Return the first stamp of a calendar as it is shown; '' of another column."""
    from pyarrow import timestamp, types

    if not types.is_timestamp(column.type):
        return ''
    known, zone = column.drop_null(), ''
    if column.type.tz:
        known, zone = known.cast(timestamp(column.type.unit, 'UTC')), ' UTC'
    return str(known.slice(0, 1).cast('string')[0]).removesuffix('Z') + zone if len(known) else ''


def is_clock(column: Any) -> bool:
    """Tell whether a column holds stamps of a calendar or durations."""
    from pyarrow import types

    return bool(types.is_timestamp(column.type) or types.is_duration(column.type))


def zero_of(column: Any, near: int = 0) -> int:
    """
    Return what to take off whole numbers that float64 cannot hold: their first; 0 of others.

    Where it serves as well ``near`` is returned, the zero of another column.
    """
    from pyarrow import ArrowInvalid, types

    if not types.is_integer(column.type):
        return 0
    try:
        column.cast('float64')
    except ArrowInvalid:
        first = int(next(one for one in column if one.is_valid).as_py())
        return near if near and abs(first - near) < _HELD else first
    return 0


def _whole(column: Any, zero: int) -> np.ndarray:
    """Return whole numbers as float64, less a zero."""
    from pyarrow import compute, scalar

    less = compute.subtract(column, scalar(zero, column.type)) if zero else column
    return np.asarray(less.cast('float64', safe=False).to_numpy())
