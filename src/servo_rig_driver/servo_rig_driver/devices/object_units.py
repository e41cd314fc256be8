"""Which units the objects of a drive and its sensors have; their values go on unchanged."""

from __future__ import annotations

from collections.abc import Iterable

from .pdo_table import FrameError, FrameTable

_UNITS = {'position': ('rad', 'm'), 'velocity': ('rad/s', 'm/s'), 'torque': ('N m', 'N'),
          'current': ('A',), 'voltage': ('V',), 'temperature': ('degC',)}
"""The units that columns and targets have, by the word that stands in the names of objects."""


def check_units(frames: FrameTable, named: Iterable[tuple[str, str]]) -> None:
    """Raise FrameError for an object in another unit, or in none that its file says."""
    for node, name in named:
        for frame in frames.values():
            if frame.name.startswith(node + '.') and name in frame.names:
                unit = frame.fields[frame.names.index(name)].unit
                units = next(units for word, units in _UNITS.items() if word in name)
                if unit not in units:
                    has = f'has the unit {unit!r}' if unit else 'has no Unit'
                    raise FrameError(f'{node}: {name} {has}; it must be one of {list(units)}: '
                                     f'give the Factor that makes it so, and the Unit')
