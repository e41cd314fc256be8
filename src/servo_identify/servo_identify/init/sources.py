"""What a file of data offers: names, units, types of messages, and the numbers themselves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..data.column_names import looks_like, split
from ..data.csv_layout import TEXTS
from ..data.csv_table import count_of_bare_columns
from ..data.json_file import read_json
from ..data.message_files import holds_messages
from ..data.messages import fields_of
from ..data.newest_first import oldest_first
from ..data.several_runs import long_enough
from ..data.tables import read_tables


@dataclass(frozen=True)
class Offered:
    """
    The sources of a file, by the names that a mapping file gives them.

    ``units`` are those that a header or a type of message gives, ``kinds`` the types of messages.
    ``numbers`` are the columns of a table, empty for messages. ``rows`` and ``names`` are what a
    mapping file must say of the file as a whole. ``refused`` says of other columns why they
    hold no numbers. ``firsts`` are the first numbers of columns as they stand in the file.
    """

    path: Path
    sources: tuple[str, ...]
    units: Mapping[str, str] = field(default_factory=dict)
    kinds: Mapping[str, str] = field(default_factory=dict)
    numbers: Mapping[str, np.ndarray] = field(default_factory=dict)
    rows: str = ''
    names: tuple[str, ...] = ()
    refused: Mapping[str, str] = field(default_factory=dict)
    firsts: Mapping[str, float] = field(default_factory=dict)

    @property
    def messages(self) -> bool:
        """Whether the sources are fields of messages."""
        return bool(self.kinds)


def offered(path: Path) -> Offered:
    """Look at a file; raises ValueError or OSError that names it."""
    if holds_messages(path):
        kinds = fields_of(path)
        if 'servo_twin_msgs/msg/Encoder' in kinds.values():
            raise ValueError(f'{path} is a bag of this project already: its columns and units are '
                             'known, and `servo-identify info` shows them. For a servo file copy '
                             'the nearest of config/servos')
        units = {source: unit for source, kind in kinds.items()
                 if (unit := _unit_of(source, kind))}
        return Offered(path, tuple(kinds), units, kinds)
    rows, names = '', ()
    if path.suffix.lower() == '.json' and path.is_file():
        rows = _rows(path)
    if path.suffix.lower() in TEXTS and path.is_file():
        names = tuple(f'column_{k + 1}' for k in range(count_of_bare_columns(path)))
    table = long_enough(read_tables(path, rows, names))[0][0]  # of several runs the first
    table = oldest_first(table, next((name for name in table.columns if looks_like(name) == 't'),
                                     ''))
    units = {name: unit for name in table.columns if (unit := split(name)[1])}
    return Offered(path, tuple(table.columns), units | dict.fromkeys(table.begins, 's'),
                   {}, table.columns, rows, names, table.refused, {
                        name: table.first(name) for name in table.columns})


def _unit_of(source: str, kind: str) -> str:
    """Return the unit that a standard message fixes (REP 103)."""
    if source.endswith('.stamp'):
        return 's'
    name = kind.rpartition('/')[2]
    if name in ('JointState', 'JointTrajectoryControllerState', 'MultiDOFJointState'):
        return {'position': 'rad', 'positions': 'rad', 'velocity': 'rad/s', 'velocities': 'rad/s',
                'effort': 'N m', 'efforts': 'N m'}.get(
                    source.rpartition('[')[0].rpartition('.')[2], '')
    if name == 'DynamicJointState':
        return {'[position]': 'rad', '[velocity]': 'rad/s'}.get(
            source[source.rfind('['):], '')
    return 'N m' if name.startswith('Wrench') and '.torque.' in source else ''


def _rows(path: Path) -> str:
    """Return the name of the list of records in a JSON file, '' where there is none."""
    try:
        content = read_json(path)
    except ValueError:
        return ''  # what reads it says why
    lists = {name: value for name, value in content.items()
             if isinstance(value, list) and value and isinstance(value[0], dict)
             } if isinstance(content, dict) else {}
    return max(lists, key=lambda name: len(lists[name]), default='')
