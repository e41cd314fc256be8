"""
Where the fields of a CDR message lie when all messages of a topic have the same shape.

CDR (OMG XTypes 1.3, clause 7.4, encoding version 1, little endian): four bytes of encapsulation,
then the fields in order, each aligned to its own size; strings and sequences start with their
length. With the lengths fixed, every field has a fixed place, and numpy reads or writes a column
of it over thousands of messages at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

HEADER = b'\x00\x01\x00\x00'
"""Encapsulation of little-endian CDR."""

_SCALARS = {
    'bool': 'u1', 'byte': 'u1', 'char': 'u1', 'octet': 'u1', 'uint8': 'u1', 'int8': 'i1',
    'uint16': '<u2', 'int16': '<i2', 'uint32': '<u4', 'int32': '<i4', 'uint64': '<u8',
    'int64': '<i8', 'float32': '<f4', 'float64': '<f8',
}

LengthOf = Callable[[str, int], int]
"""Gives the length of the string (with its final zero) or sequence at (path, byte offset)."""


class NotConstantError(ValueError):
    """A message type whose fields have no fixed places, such as one with a list of strings."""


@dataclass(frozen=True)
class Layout:
    """
    Places of all fields of one message type for given lengths.

    ``fields`` maps dotted paths to (numpy dtype, byte offset); ``lengths`` maps the byte offset of
    each length word to (path, value). Messages share a layout when their length words agree.
    """

    size: int
    fields: dict[str, tuple[np.dtype, int]]
    lengths: dict[int, tuple[str, int]]

    def dtype(self, itemsize: int, shift: int = 0) -> np.dtype:
        """Return the type of records of ``itemsize`` bytes, the message ``shift`` bytes in."""
        return np.dtype({
            'names': list(self.fields),
            'formats': [kind for kind, _ in self.fields.values()],
            'offsets': [offset + shift for _, offset in self.fields.values()],
            'itemsize': itemsize,
        })


def lay_out(types: Typestore, name: str, length_of: LengthOf) -> Layout:
    """Return the places of the fields of message ``name``; raises NotConstantError."""
    fields: dict[str, tuple[np.dtype, int]] = {}
    lengths: dict[int, tuple[str, int]] = {}
    offset = 0

    def place(path: str, scalar: str, count: int | None) -> None:
        nonlocal offset
        if scalar not in _SCALARS:
            raise NotConstantError(f'{name}.{path}: {scalar} has no fixed size')
        kind = np.dtype(_SCALARS[scalar])
        if count != 0:
            offset = -(-offset // kind.itemsize) * kind.itemsize
        fields[path] = (kind if count is None else np.dtype((kind, (count,))), offset + 4)
        offset += kind.itemsize * (1 if count is None else count)

    def length_word(path: str) -> int:
        nonlocal offset
        offset = -(-offset // 4) * 4
        count = length_of(path, offset + 4)
        lengths[offset + 4] = (path, count)
        offset += 4
        return count

    def walk(kind: str, prefix: str) -> None:
        for field, (node, detail) in types.fielddefs[kind][1]:
            path = prefix + field
            if node == Nodetype.NAME:
                walk(detail, path + '.')
            elif node == Nodetype.BASE and detail[0] == 'string':
                place(path, 'uint8', length_word(path))
            elif node == Nodetype.BASE:
                place(path, detail[0], None)
            else:
                (inner, scalar), count = detail
                if inner != Nodetype.BASE:
                    raise NotConstantError(f'{name}.{path}: a list of {scalar}')
                fixed = node == Nodetype.ARRAY
                place(path, scalar[0], count if fixed else length_word(path))

    walk(name, '')
    return Layout(offset + 4, fields, lengths)
