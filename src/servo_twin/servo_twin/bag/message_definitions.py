"""The message definitions of the project for readers and writers that have no ROS."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
import os
from pathlib import Path
from struct import error as StructError
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import get_types_from_idl, get_types_from_msg, get_typestore, Stores
from rosbags.typesys.base import TypesysError
from rosbags.typesys.store import Typestore

PACKAGE = 'servo_twin_msgs'


def definition_folder() -> Path:
    """
    Return the folder with the project's .msg files.

    An installed share folder comes first (AMENT_PREFIX_PATH, or an install tree around this file),
    then the source tree. Raises FileNotFoundError naming the places looked at.
    """
    looked: list[Path] = []
    for folder in _candidates():
        if (folder / 'Encoder.msg').is_file():
            return folder
        looked.append(folder)
    raise FileNotFoundError(
        f'message definitions of {PACKAGE} not found; looked at '
        f'{", ".join(str(folder) for folder in looked)}; build the workspace or source it'
    )


def _candidates() -> Iterator[Path]:
    for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep):
        if prefix:
            yield Path(prefix) / 'share' / PACKAGE / 'msg'
    for parent in list(Path(__file__).resolve().parents)[2:8]:
        yield parent / PACKAGE / 'msg'
        yield parent / 'share' / PACKAGE / 'msg'
        yield parent / PACKAGE / 'share' / PACKAGE / 'msg'
        yield parent / 'share' / 'servo_twin' / 'msg'  # as pip installs them, without ROS


@cache
def own_types() -> Typestore:
    """Return the standard messages of ROS 2 Jazzy together with the project's own."""
    store = get_typestore(Stores.ROS2_JAZZY)
    found: dict = {}
    for path in sorted(definition_folder().glob('*.msg')):
        found.update(get_types_from_msg(path.read_text('utf8'), f'{PACKAGE}/msg/{path.stem}'))
    store.register(found)
    return store


def commented(kind: str) -> str:
    """Return the definition of a message of the project as people wrote it, with its units."""
    text = (definition_folder() / f'{kind.rpartition("/")[2]}.msg').read_text('utf8')
    parts = own_types().generate_msgdef(kind, ros_version=2)[0].partition('=' * 80)
    return text + ''.join(parts[1:])


@cache
def embedded_types(name: str, encoding: str, text: str) -> Typestore:
    """Return what a bag itself says of message ``name``; ``encoding`` is ros2msg or ros2idl."""
    store = get_typestore(Stores.EMPTY)
    if encoding not in ('ros2msg', 'ros2idl'):
        raise ValueError(f'{name}: definition in {encoding!r}; known are ros2msg and ros2idl')
    try:
        store.register(get_types_from_msg(text, name) if encoding == 'ros2msg'
                       else get_types_from_idl(text))
    except TypesysError as error:
        raise ValueError(f'{name}: its definition in the bag does not parse: {error}') from None
    return store


def deserialize(types: Typestore, name: str, payload: bytes) -> Any:
    """Return one message as an object; raises ValueError when the bytes are not such a message."""
    try:
        return types.deserialize_cdr(payload, name)
    except (SerdeError, StructError, LookupError, ValueError, AssertionError) as error:
        raise ValueError(f'{name} of {len(payload)} bytes does not decode: {error}') from None
