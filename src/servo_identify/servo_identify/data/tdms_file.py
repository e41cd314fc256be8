"""A file of LabVIEW (TDMS) as arrays with their units and times, by npTDMS."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .column_names import looks_like, split

_UNITS = ('unit_string', 'NI_UnitDescription', 'unit')
"""Properties of a channel that hold its unit."""
_SECOND = np.timedelta64(1, 's')
_TIME = 'time [s]'


def load_tdms(path: Path) -> dict[str, np.ndarray]:
    """
    Return the channels of numbers of a TDMS file, (rows,), by ``group.channel [unit]``.

    Of a file of one group the names are those of the channels. Waveforms get the times, s, that
    their properties tell, stamps of a calendar count from the first instant of the file. Channels
    of a group with different times are ``channel.values``, beside ``channel.time``. Raises
    ValueError where npTDMS lacks, and for a damaged file.
    """
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise ValueError(f'{path}: reading TDMS needs `pip install nptdms`; or export it as CSV'
                         ) from None
    try:
        groups = [group for group in TdmsFile.read(path).groups() if group.channels()]
    except Exception as error:  # of a damaged file it says what comes
        raise ValueError(f'{path} is no TDMS file: {error}') from None
    begin = min((_first(channel) for group in groups for channel in group.channels()
                 if _first(channel) is not None), default=None)
    found = dict[str, np.ndarray]()
    for group in groups:
        above = f'{group.name}.' if len(groups) > 1 else ''
        found |= {f'{above}{name}': column for name, column in _columns(group, begin).items()}
    return found


def _columns(group: Any, begin: Any) -> dict[str, np.ndarray]:
    """Return the channels of a group with their units, and the times of its waveforms."""
    channels = {_named(one): one for one in group.channels()}
    columns = {name: column for name, one in channels.items()
               if (column := _numbers(one[:], begin)) is not None}
    if any(looks_like(name) == 't' for name in columns):
        return columns
    times = {name: time for name in columns
             if (time := _times(channels[name], len(columns[name]), begin)) is not None}
    first = next(iter(times.values()), None)
    if first is not None and all(np.array_equal(first, time) for time in times.values()):
        return {_TIME: first, **columns}
    apart = dict[str, np.ndarray]()
    for name, column in columns.items():
        bare, unit = split(name)
        if name in times:
            apart[f'{bare}.{_TIME}'] = times[name]
            name = f'{bare}.values [{unit}]' if unit else f'{bare}.values'
        apart[name] = column
    return apart


def _named(channel: Any) -> str:
    """Return the name of a channel with its unit behind it."""
    unit = next((str(channel.properties[key]) for key in _UNITS if channel.properties.get(key)),
                '')
    return f'{channel.name} [{unit}]' if unit and not split(channel.name)[1] else channel.name


def _numbers(column: np.ndarray, begin: Any) -> np.ndarray | None:
    """Return a column as float64, stamps in s since the begin; None for texts."""
    if column.dtype.kind == 'M':
        return np.asarray((column - begin) / _SECOND)
    return column.astype(np.float64) if column.dtype.kind in 'fiub' else None


def _times(channel: Any, rows: int, begin: Any) -> np.ndarray | None:
    """Return the times of a waveform, s; None of a channel that is none."""
    period = channel.properties.get('wf_increment')
    if not period:
        return None
    start = channel.properties.get('wf_start_time')
    late = (np.datetime64(start) - begin) / _SECOND if start is not None else 0.0
    return np.asarray(late + channel.properties.get('wf_start_offset', 0.0)
                      + period * np.arange(rows))


def _first(channel: Any) -> Any:
    """Return the first instant of a channel of stamps or of a waveform; None of others."""
    if channel.dtype is not None and channel.dtype.kind == 'M' and len(channel):
        return channel[0]
    start = channel.properties.get('wf_start_time')
    return None if start is None else np.datetime64(start)
