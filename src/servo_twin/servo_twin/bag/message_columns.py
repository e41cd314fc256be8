"""Payloads of one topic turned into columns: all messages of equal shape at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from rosbags.typesys.store import Typestore

from .cdr_layout import lay_out, Layout, NotConstantError
from .message_definitions import deserialize

_SHAPES = 16
"""Message shapes in one chunk beyond which they are decoded one by one."""

_WHOLE = ('header.stamp.sec', 'header.stamp.nanosec', 'sequence', 'period')


@dataclass
class Run:
    """
    Messages of one topic with the same number of samples and period, in the order of the file.

    ``sequence``, ``stamp`` (ns) have shape (n,), int64; ``period`` is in s; ``size`` is the number
    of samples a message. ``values`` maps fields to (n, size), read where they lie; a field whose
    list is empty is not in it. ``constants`` holds what the last message says besides.
    """

    sequence: np.ndarray
    stamp: np.ndarray
    period: float
    size: int
    values: Mapping[str, np.ndarray]
    constants: dict[str, np.ndarray] = field(default_factory=dict)

    def head(self) -> Run:
        """Return the first message without its samples."""
        return Run(self.sequence[:1].copy(), self.stamp[:1].copy(), self.period, self.size, {},
                   self.constants)


def decode(types: Typestore, kind: str, payloads: np.ndarray) -> list[Run]:
    """
    Return the runs in payloads of equal length, shape (n,) of type void.

    Raises ValueError when a message is shorter than its own lengths say, or when the lists of one
    message differ in length.
    """
    found: list[Run] = []
    rest = payloads
    while len(rest):
        first = bytes(rest[0])
        if first[:2] != b'\x00\x01' or len(found) >= _SHAPES:
            return found + [_decode_one(types, kind, bytes(payload)) for payload in rest]
        try:
            layout = lay_out(types, kind, partial(_word, kind, first))
        except NotConstantError:
            return found + [_decode_one(types, kind, bytes(payload)) for payload in rest]
        if layout.size > len(first):
            raise ValueError(f'{kind} of {len(first)} bytes where its lengths make {layout.size}')
        same = _share(layout, rest)
        chosen = rest if same.all() else rest[same]
        found.append(_run(kind, layout, chosen.view(layout.dtype(len(first)))))
        rest = rest[~same]
    return found


def _word(kind: str, payload: bytes, _: str, offset: int) -> int:
    count = int.from_bytes(payload[offset:offset + 4], 'little')
    if count > len(payload):
        raise ValueError(f'{kind} of {len(payload)} bytes with a list of {count} at {offset}')
    return count


def _share(layout: Layout, payloads: np.ndarray) -> np.ndarray:
    """Return which payloads have the length words of the layout, and the period of the first."""
    words = payloads.view(np.dtype({
        'names': ['encapsulation', 'period', *map(str, layout.lengths)],
        'formats': ['<u2', '<u8'] + ['<u4'] * len(layout.lengths),
        'offsets': [0, layout.fields['period'][1], *layout.lengths],
        'itemsize': payloads.dtype.itemsize}))
    same = words['encapsulation'] == 0x0100
    same &= words['period'] == words['period'][0]
    for offset, (_, count) in layout.lengths.items():
        same &= words[str(offset)] == count
    return same


def _run(kind: str, layout: Layout, records: np.ndarray) -> Run:
    lists = {path: count for path, count in layout.lengths.values()
             if not path.startswith('header.')}
    size = _one_length(kind, lists)
    values = {path: records[path] for path, count in lists.items() if count}
    constants = {path: np.array(records[path][-1]) for path in layout.fields
                 if path not in lists and path not in _WHOLE and not path.startswith('header.')}
    seconds, rest = (records[path].astype(np.int64) for path in _WHOLE[:2])
    return Run(records['sequence'].astype(np.int64), seconds * 10**9 + rest,
               float(records['period'][0]), size, values, constants)


def _one_length(kind: str, lists: dict[str, int]) -> int:
    sizes = set(lists.values()) - {0}
    if len(sizes) > 1:
        raise ValueError(f'{kind} with lists of different lengths {lists}')
    return sizes.pop() if sizes else 0


def _decode_one(types: Typestore, kind: str, payload: bytes) -> Run:
    """Decode a message by rosbags: any byte order, any shape."""
    message = deserialize(types, kind, payload)
    lists, constants = {}, {}
    for name, (node, _) in types.fielddefs[kind][1]:
        if name in ('header', 'sequence', 'period'):
            continue
        target = lists if node.name == 'SEQUENCE' else constants
        target[name] = np.array(getattr(message, name))
    size = _one_length(kind, {name: len(value) for name, value in lists.items()})
    values = {name: value.astype(np.float64)[None] for name, value in lists.items() if len(value)}
    stamp = message.header.stamp
    return Run(np.array([message.sequence], np.int64),
               np.array([stamp.sec * 10**9 + stamp.nanosec]), float(message.period),
               size, values, constants)
