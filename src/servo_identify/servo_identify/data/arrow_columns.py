"""Columns of Arrow as numbers."""

from __future__ import annotations

from typing import Any

import numpy as np


def numbers_of(column: Any) -> np.ndarray | None:
    """Return a column as float64, stamps and durations in s; None for what may be text."""
    from pyarrow import types

    kind = column.type
    if types.is_null(kind):
        return np.full(len(column), np.nan)
    if types.is_timestamp(kind):
        return _seconds(column)
    if types.is_duration(kind):
        return np.asarray(column.to_numpy() / np.timedelta64(1, 's'))
    if types.is_integer(kind):
        return _whole(column)
    if types.is_floating(kind) or types.is_boolean(kind):
        return np.asarray(column.cast('float64').to_numpy())
    return None


def _seconds(column: Any) -> np.ndarray:
    """Return stamps as s since the first of them."""
    from pyarrow import timestamp

    counts = column.cast(timestamp('ns', column.type.tz)).cast('int64').to_pylist()
    first = next((one for one in counts if one is not None), 0)
    return np.array([np.nan if one is None else (one - first) * 1e-9 for one in counts])


def _whole(column: Any) -> np.ndarray:
    """Return whole numbers; those that float64 cannot hold, stamps in ns, since the first."""
    from pyarrow import ArrowInvalid, compute

    try:
        return np.asarray(column.cast('float64').to_numpy())
    except ArrowInvalid:
        first = next(one for one in column if one.is_valid)
        return np.asarray(compute.subtract(column, first).cast('float64', safe=False).to_numpy())
