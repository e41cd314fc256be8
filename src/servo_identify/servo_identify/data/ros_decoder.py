"""Decoders of ROS 2 messages by the definition that a file holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def cdr_decoder(kind: str, encoding: str, text: str) -> Callable[[bytes], Any]:
    """
    Return a decoder of CDR messages of a type.

    ``encoding`` is that of the definition ``text``: ros2msg or ros2idl. Without a text the type
    must be one of Jazzy's own; raises ValueError where it is not.
    """
    from rosbags.typesys import get_types_from_idl, get_types_from_msg, get_typestore, Stores

    parts = kind.split('/')
    name = f'{parts[0]}/msg/{parts[-1]}'
    store = get_typestore(Stores.ROS2_JAZZY)
    if text:
        types = get_types_from_idl(text) if 'idl' in encoding else get_types_from_msg(text, name)
        store.register({key: value for key, value in types.items()
                        if key not in store.fielddefs})
    elif name not in store.fielddefs:
        raise ValueError(f'the file has no definition of {kind}; record it again as MCAP')
    return lambda raw: store.deserialize_cdr(raw, name)
