"""
Reads the object dictionaries (EDS files) of a rig's three nodes.

They are the drive, the encoder on the load, and the torque sensor with the load simulator. Scales
and units come from there and nowhere else. Shipped sets are folders below eds/; a folder of one's
own is given by its path. `Factor` and `Unit` are the keys that the canopen library reads beside
those of CiA 306, which knows neither. So a vendor's file says nothing of them, and who adds a
Factor says in which Unit the value is then; `1` stands for a share or a count.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
import re

from canopen import import_od, ObjectDictionary

_FACTOR = re.compile(r'(?mi)^[ \t]*Factor[ \t]*[=:][ \t]*(.*?)[ \t]*\r?$')
_UNIT = re.compile(r'(?mi)^[ \t]*Unit[ \t]*[=:][ \t]*[^\s;#]')
_SECTION = re.compile(r'(?m)^\[(.*?)\]')
_SMALLEST, _LARGEST = 1e-30, 1e30  # of a Factor: beyond them values of 32 bits overflow
SHIPPED = Path(__file__).parent / 'eds'
NODE_IDS: Mapping[str, int] = {'drive': 1, 'load_encoder': 2, 'torque_sensor': 3}


class DriveMode(IntEnum):
    """Modes of operation (objects 6060h, 6061h) that the drives here know."""

    CURRENT = -2
    VOLTAGE = -1
    NONE = 0
    POSITION = 8
    VELOCITY = 9
    TORQUE = 10


class DictionaryError(ValueError):
    """Object dictionaries that are missing, cannot be read or miss what the rig needs."""


@dataclass(frozen=True)
class Dictionaries:
    """The object dictionaries by node name, and the node ids that they were read for."""

    folder: Path
    nodes: Mapping[str, ObjectDictionary]
    ids: Mapping[str, int]


def shipped_sets() -> list[str]:
    """Return the names of the sets that come with the package."""
    return sorted(folder.name for folder in SHIPPED.iterdir() if folder.is_dir())


def load_dictionaries(name: str = 'rv_bench',
                      ids: Mapping[str, int] = NODE_IDS) -> Dictionaries:
    """
    Read the three EDS files of a shipped set or of a folder.

    Raises DictionaryError when there is no such set or folder, a file is missing or broken, or
    node ids are not three different numbers from 1 to 127.
    """
    if set(ids) != set(NODE_IDS):
        raise DictionaryError(f'node ids are given for {sorted(ids)}; needed are '
                              f'{sorted(NODE_IDS)}')
    if len(set(ids.values())) != len(ids) or not all(1 <= i <= 127 for i in ids.values()):
        raise DictionaryError(f'node ids {dict(ids)} must be different and from 1 to 127')
    folder = SHIPPED / name if (SHIPPED / name).is_dir() else Path(name)
    if not folder.is_dir():
        raise DictionaryError(f"'{name}' is neither a folder nor one of the shipped sets "
                              f'{shipped_sets()}')
    nodes = {node: _read(folder / f'{node}.eds', number) for node, number in ids.items()}
    return Dictionaries(folder, nodes, dict(ids))


def _read(path: Path, node_id: int) -> ObjectDictionary:
    if not path.is_file():
        raise DictionaryError(f'{path} is missing')
    try:
        _check_factors(path.read_text('utf8', errors='replace'))
        return import_od(str(path), node_id)
    except Exception as error:  # configparser's, canopen's and plain ValueErrors alike
        raise DictionaryError(f'{path} is no EDS file that can be read: {error}') from error


def _check_factors(text: str) -> None:
    """
    Raise ValueError for a Factor that is no scale or makes a value of no unit.

    Of the first canopen takes 1 without a word, of the second any unit could be meant.
    """
    objects = [*_SECTION.finditer(text)]
    ends = [one.start() for one in objects[1:]] + [len(text)]
    for one, end in zip(objects, ends, strict=True):
        scale = _FACTOR.search(text, one.end(), end)
        if scale and not _UNIT.search(text, one.end(), end):
            line = text.count('\n', 0, scale.start()) + 1
            raise ValueError(f'line {line}: Factor = {scale[1]!r} of object {one[1]} has no Unit; '
                             f'give the unit that the value has with it, such as Unit=rad, or '
                             f'Unit=1 for a share or a count')
    for found in _FACTOR.finditer(text):
        try:
            size = abs(float(found[1]))
        except ValueError:
            size = 0.0
        if not _SMALLEST <= size <= _LARGEST:
            line = text.count('\n', 0, found.start()) + 1
            raise ValueError(f'line {line}: Factor = {found[1]!r} is no scale; give a number of a '
                             f'size within [{_SMALLEST:g}, {_LARGEST:g}], with a decimal point')
