"""Recordings as people hold them in memory: dictionaries, pandas frames, xarray data sets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeGuard

import numpy as np

from servo_twin.recording.recording import COLUMNS, Recording


def columns_of(held: Any) -> dict[str, np.ndarray]:
    """
    Return the columns of a dictionary, a pandas DataFrame or an xarray Dataset, each (samples,).

    An index or coordinate named ``t`` is the time, in s, as a duration or as stamps of a calendar,
    which count from the first. A unit in the ``units`` attribute of an xarray variable goes behind
    its name, as ``motor_position [deg]``. Raises ValueError for a column that holds no numbers.
    """
    if hasattr(held, 'data_vars'):
        variables = {str(one): held[one] for one in [*held.coords, *held.data_vars]}
        return {_with_unit(name, one.attrs.get('units', '')): _numbers(name, one.values)
                for name, one in variables.items()}
    index: Any = getattr(held, 'index', None)
    found = {'t': _numbers('t', index.values)} if getattr(index, 'name', None) == 't' else {}
    return found | {str(one): _numbers(str(one), held[one]) for one in held}


def in_memory(data: Any) -> TypeGuard[Mapping[str, Any]]:
    """Whether something is columns in memory, not the name of a file or several names."""
    return isinstance(data, Mapping) or hasattr(data, 'columns') or hasattr(data, 'data_vars')


def table_of(recording: Recording) -> dict[str, np.ndarray]:
    """Return ``t`` in s and the channels that were measured, each of shape (samples,)."""
    measured = {name: recording[name] for name in COLUMNS if recording.has(name)}
    return {'t': recording.time} | measured


def frame_of(recording: Recording) -> Any:
    """Return a pandas DataFrame whose index is ``t`` in s. Raises ImportError without pandas."""
    import pandas

    columns = table_of(recording)
    time = columns.pop('t')
    return pandas.DataFrame(columns, index=pandas.Index(time, name='t'))


def dataset_of(recording: Recording) -> Any:
    """Return an xarray Dataset over ``t`` in s, with units. Raises ImportError without xarray."""
    import xarray

    columns = table_of(recording)
    time = columns.pop('t')
    return xarray.Dataset(
        {name: ('t', column, {'units': COLUMNS[name]}) for name, column in columns.items()},
        coords={'t': ('t', time, {'units': 's'})},
        attrs={'name': recording.name, 'family': recording.family})


def _with_unit(name: str, unit: str) -> str:
    return f'{name} [{unit}]' if unit else name


def _numbers(name: str, column: Any) -> np.ndarray:
    values = np.asarray(column)
    if values.dtype.kind == 'M':
        values = values - values[:1]
    if values.dtype.kind == 'm':
        return values / np.timedelta64(1, 's')
    try:
        return values.astype(float)
    except (TypeError, ValueError) as problem:
        raise ValueError(f'column {name!r} holds no numbers: {problem}') from None
