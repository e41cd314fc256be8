"""Definitions of the messages that are recorded: their types, and the text as people wrote it."""

from __future__ import annotations

from pathlib import Path

from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from rosbags.typesys.store import Typestore

_BETWEEN = '=' * 80 + '\n'
_NAMED = 'MSG: '


def typestore(kinds: list[str], shares: list[Path]) -> Typestore:
    """
    Return the types of Jazzy, and those of further packages from their .msg files.

    Raises FileNotFoundError for a type without a definition below ``shares``.
    """
    store = get_typestore(Stores.ROS2_JAZZY)
    for package in sorted({kind.split('/')[0] for kind in kinds if kind not in store.fielddefs}):
        folders = [share / package / 'msg' for share in shares]
        files = [file for folder in folders for file in sorted(folder.glob('*.msg'))]
        if not files:
            raise FileNotFoundError(
                f'no message definitions of {package}; looked in '
                f'{", ".join(str(folder) for folder in folders) or "no folder"}; source the '
                'workspace that has it')
        found: dict = {}
        for file in files:
            found |= get_types_from_msg(file.read_text('utf8'), f'{package}/msg/{file.stem}')
        store.register({name: fields for name, fields in found.items()
                        if name not in store.fielddefs})
    missing = [kind for kind in kinds if kind not in store.fielddefs]
    if missing:
        raise FileNotFoundError(f'no definition of {missing}; a type is written package/msg/Name')
    return store


def commented(store: Typestore, kind: str, shares: list[Path]) -> str:
    """
    Return the definition of a message with all that it is made of, comments and units included.

    A part whose .msg file is in none of ``shares`` is written from its fields, without comments.
    """
    first, *others = store.generate_msgdef(kind, ros_version=2)[0].split(_BETWEEN)
    parts = [_text(kind, shares) or first]
    for other in others:
        name, _, fields = other.removeprefix(_NAMED).partition('\n')
        parts.append(f'{_NAMED}{name}\n{_text(name, shares) or fields}')
    return _BETWEEN.join(part if part.endswith('\n') else f'{part}\n' for part in parts)


def _text(kind: str, shares: list[Path]) -> str:
    package, name = kind.split('/')[0], kind.split('/')[-1]
    for share in shares:
        file = share / package / 'msg' / f'{name}.msg'
        if file.is_file():
            return file.read_text('utf8')
    return ''
