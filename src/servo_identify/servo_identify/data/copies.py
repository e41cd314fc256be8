"""Recordings that are copies of each other, which repeat nothing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from hashlib import sha256

import numpy as np

from servo_twin.recording.recording import COLUMNS, Recording

from .finding import Finding


def copies(recordings: Sequence[Recording]) -> Iterator[Finding]:
    """
    Yield which recordings hold the same samples as one before.

    On a machine no motion repeats to the last bit; that of a simulator without noise may.
    """
    first = dict[bytes, Recording]()
    for one in recordings:
        if not any(map(one.has, COLUMNS)):  # a hole, of a long recording
            continue
        known = first.setdefault(_digest(one), one)
        if known is not one:
            yield Finding('amber', f'{one.name} holds the same samples as {known.name}: a copy '
                          'repeats no motion, and an answer by it looks surer than it is.',
                          'name each recording once, unless a simulator without noise made them')


def _digest(one: Recording) -> bytes:
    held = sha256(repr((one.period, len(one))).encode())
    for name in COLUMNS:
        if one.has(name):
            held.update(name.encode() + np.ascontiguousarray(one[name]).tobytes())
    return held.digest()
