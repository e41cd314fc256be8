"""A recording of any length, part by part: what is too long for the memory is never held whole."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol, TypeVar

from .recording import Predictions, Recording

SAMPLES = 60_000
"""Samples in a part: 60 s at 1 kHz. A shorter recording is one part."""

Part = TypeVar('Part', Recording, Predictions, covariant=True)


class Long(Protocol[Part]):
    """
    A recording, or what a twin answered to one, that gives any part of itself.

    ``name``, ``period``, ``start``, ``sequence`` and ``warnings`` are those of Recording.
    """

    name: str
    period: float
    start: float
    sequence: int

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be said of it."""
        ...

    def __len__(self) -> int: ...

    def part(self, first: int, end: int) -> Part:
        """Return the samples numbered from ``first`` to ``end``, as far as there are."""
        ...


class LongRecording(Long[Recording], Protocol):
    """A recording that gives any part of itself; names are those of Recording."""

    servo: str
    servo_file: str
    family: str

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the end of the last one."""
        ...


def parts_of(long: Long[Part], samples: int = 0) -> Iterator[Part]:
    """Yield the parts of a recording in order, of SAMPLES or so many; the last may be shorter."""
    step = samples or SAMPLES
    end = long.sequence + len(long)
    for first in range(long.sequence, end, step):
        yield long.part(first, min(end, first + step))
