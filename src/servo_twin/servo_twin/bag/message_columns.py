"""Payloads of one topic turned into columns: all messages of equal shape at once."""

from __future__ import annotations

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

    ``sequence``, ``stamp`` (ns) have shape (n,), int64; ``period`` is in s; ``values`` maps fields
    to (n, samples a message); ``constants`` holds what the last message says besides.
    """

    sequence: np.ndarray
    stamp: np.ndarray
    period: float
    values: dict[str, np.ndarray]
    constants: dict[str, np.ndarray] = field(default_factory=dict)


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
    count = len(records)
    values = {path: np.ascontiguousarray(records[path], np.float64) if lists[path]
              else np.full((count, size), np.nan) for path in lists}
    constants = {path: np.array(records[path][-1]) for path in layout.fields
                 if path not in lists and path not in _WHOLE and not path.startswith('header.')}
    seconds, rest = (records[path].astype(np.int64) for path in _WHOLE[:2])
    return Run(records['sequence'].astype(np.int64), seconds * 10**9 + rest,
               float(records['period'][0]), values, constants)


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
    values = {name: value.astype(np.float64)[None] if len(value) else np.full((1, size), np.nan)
              for name, value in lists.items()}
    stamp = message.header.stamp
    return Run(np.array([message.sequence], np.int64),
               np.array([stamp.sec * 10**9 + stamp.nanosec]), float(message.period),
               values, constants)
