"""Recordings as people hold them in memory: dictionaries, pandas frames, xarray data sets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import datetime, UTC
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from servo_twin.recording.recording import COLUMNS, Recording

from ..data.clock_times import seconds_of
from ..data.column_names import TIMES
from ..data.column_units import time_of
from ..data.table import Table
from .extras import needed


def table_in(held: Any, name: str) -> Table:
    """
    Return a dictionary, a frame (pandas, polars), an Arrow table or an xarray Dataset as a table.

    An index or coordinate is the time where its name says so, or where it holds times: in s, as a
    duration or as stamps of a calendar, which count from the first. A unit in the ``units``
    attribute of an xarray variable goes behind its name, as ``motor_position [deg]``, and so does
    the second line of a header of two. What a masked array hides is NaN. Columns
    that hold no numbers are refused to whoever asks for them. Columns of shape (samples, 1) are
    (samples,); raises ValueError for one of several.
    """
    table = Table(Path(name), {})
    _check_order(held, name)
    for column, values in _named(held):
        try:
            numbers = _numbers(column, values)
        except ValueError as problem:
            table.refused[column] = str(problem)
            continue
        if numbers.ndim == 2 and numbers.shape[1] == 1:
            numbers = numbers[:, 0]
        if numbers.ndim == 0:
            raise ValueError(f'{name}: {column!r} is one number, and a column has one for each '
                             'sample; of a list of records make a frame: '
                             'pandas.DataFrame(records)')
        if numbers.ndim != 1:
            raise ValueError(f'{name}: {column!r} has the shape {numbers.shape}, and a column has '
                             '(samples,): give its parts names of their own, and several tables '
                             'as a list: read([first, second], ...)')
        table.columns[column] = numbers
        first = np.asarray(values).flat[0] if len(numbers) else None
        if isinstance(first, np.datetime64 | datetime):
            table.begins[column] = str(first)[:23].replace('T', ' ')
    if hasattr(held, 'index') and not time_of(table)[0]:
        table.refused['t'] = (f'{name} has no column t, and its index does not say that it is the '
                              "time: where it is, in s, name it: data.rename_axis('t'); else add "
                              'the period times the number of the row')
    return Table(table.path, table.columns, refused=table.refused, begins=table.begins)


def _check_order(held: Any, name: str) -> None:
    """Raise ValueError for Series side by side whose rows stand in another order or at others."""
    orders = {column: one.index for column, one in held.items()
              if hasattr(one, 'index') and hasattr(one, 'to_frame')} if (
                  isinstance(held, Mapping)) else {}
    first = next(iter(orders), '')
    for column, order in orders.items():
        if not order.equals(orders[first]):
            raise ValueError(f'{name}: {column!r} and {first!r} have rows of another index: put '
                             'them into one frame, which brings them together: '
                             'pandas.DataFrame(columns)')


def _named(held: Any) -> Iterator[tuple[str, Any]]:
    """Yield the names and values of columns."""
    if hasattr(held, 'data_vars'):
        variables = {str(one): held[one] for one in [*held.coords, *held.data_vars]}
        for name, one in variables.items():
            yield _with_unit(name, one.attrs.get('units') or one.attrs.get('unit', '')), one.values
        return
    names = held.dtype.names if isinstance(held, np.ndarray) else getattr(
        held, 'column_names', None) or getattr(held, 'columns', held)
    index: Any = _without_zone(given := getattr(held, 'index', None), given)
    called = getattr(index, 'name', None)
    if hasattr(index, 'values') and 't' not in names and (
            called in ('t', *TIMES) or index.values.dtype.kind in 'mM'):
        yield 't', index.values
    for one in names:
        header = one if isinstance(one, tuple) and len(one) == 2 else (one, '')
        column = held[one]
        yield _with_unit(*map(str, header)), _without_zone(column, getattr(column, 'dt', None))


def _without_zone(stamps: Any, clock: Any) -> Any:
    """Return stamps of pandas in UTC where they have a zone, all else as it is."""
    return clock.tz_convert(None) if getattr(clock, 'tz', None) is not None else stamps


def in_memory(data: Any) -> TypeGuard[Mapping[str, Any]]:
    """Whether something is columns in memory, not the name of a file or several names."""
    return (isinstance(data, Mapping) or hasattr(data, 'columns') or hasattr(data, 'data_vars')
            or isinstance(data, np.ndarray) and bool(data.dtype.names))


def table_of(recording: Recording) -> dict[str, np.ndarray]:
    """Return ``t`` in s and the channels that were measured, each of shape (samples,)."""
    measured = {name: recording[name] for name in COLUMNS if recording.has(name)}
    return {'t': recording.time} | measured


def frame_of(recording: Recording) -> Any:
    """Return a pandas DataFrame whose index is ``t`` in s. Raises ImportError without pandas."""
    with needed('pandas', 'data.frame'):
        import pandas

    columns = table_of(recording)
    time = columns.pop('t')
    return pandas.DataFrame(columns, index=pandas.Index(time, name='t'))


def dataset_of(recording: Recording) -> Any:
    """Return an xarray Dataset over ``t`` in s, with units. Raises ImportError without xarray."""
    with needed('xarray', 'data.dataset'):
        import xarray

    columns = table_of(recording)
    time = columns.pop('t')
    return xarray.Dataset(
        {name: ('t', column, {'units': COLUMNS[name]}) for name, column in columns.items()},
        coords={'t': ('t', time, {'units': 's'})},
        attrs={'name': recording.name, 'family': recording.family})


def _with_unit(name: str, unit: str) -> str:
    return f'{name} [{unit}]' if unit else name


def _in_utc(stamp: datetime) -> datetime:
    return stamp.astimezone(UTC).replace(tzinfo=None) if stamp.tzinfo else stamp


def _numbers(name: str, column: Any) -> np.ndarray:
    if hasattr(column, 'dtype') and hasattr(column.dtype, 'na_value'):  # pandas' own, maybe empty
        numeric = getattr(column.dtype, 'kind', 'O') in 'iufb'
        column = column.to_numpy(float, na_value=np.nan) if numeric else column.values
    if isinstance(column, np.ma.MaskedArray):
        column = np.ma.filled(column.astype(float), np.nan)
    values = np.asarray(column)
    if values.dtype.kind == 'O' and all(isinstance(one, datetime) for one in values.flat):
        values = np.array([_in_utc(one) for one in values.flat], 'datetime64[us]')
    if values.dtype.kind == 'c':
        raise ValueError(f'column {name!r} holds complex numbers; give their real part, or which '
                         'is meant')
    if values.dtype.kind == 'M':
        values = values - values[:1]
    if values.dtype.kind == 'm':
        return values / np.timedelta64(1, 's')
    clock = seconds_of(values.tolist()) if values.dtype.kind in 'OU' and values.ndim == 1 else None
    if clock is not None:
        return clock
    try:
        return values.astype(float)
    except (TypeError, ValueError, OverflowError) as problem:
        raise ValueError(f'column {name!r} holds no numbers: {problem}') from None
