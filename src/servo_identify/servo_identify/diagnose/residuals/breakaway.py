"""
The instants at which a shaft at rest breaks away: there the friction at rest shows.

A shaft at rest says nothing of its friction, but that it is enough. As the shaft starts to move,
all that was available is spent, against the motion that comes. The last window of the test
function before that is a sample at speed zero. Where a shaft sticks and slips, little else is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .test_function import TestFunction

WITHIN = 1.5  # counts, and
NOISE = 4.0  # standard deviations of a reading, by which a shaft at rest may seem to move


@dataclass(frozen=True)
class Breakaway:
    """
    A start from rest: the ``centre`` of the last window at rest, and the ``start`` after it.

    Both are samples of the recording; ``way`` is the direction that follows, +1 or -1.
    """

    centre: int
    start: int
    way: float


def breakaways(test: TestFunction, resting: np.ndarray,
               shafts: Sequence[tuple[np.ndarray, float]]) -> Iterator[Breakaway]:
    """
    Yield the starts from rest of a recording.

    ``resting`` tells at the inner samples of the test function whether the machine rests;
    ``shafts`` are the measured angles at every sample, each with how far it may seem to move at
    rest. All of them rest until they start, within a window: a motor that winds up a spring or a
    gap is no start of the load.
    """
    edges = np.flatnonzero(np.diff(resting.astype(np.int8), prepend=0, append=0))
    for first, end in zip(edges[::2] + test.reach, edges[1::2] + test.reach, strict=True):
        if end - test.reach >= len(resting):
            continue  # it rests to the end
        starts = [one for angle, within in shafts if (
            one := _start(angle, within, int(first), int(end), test.reach))]
        if len(starts) < len(shafts):
            continue
        start, way = min(starts)
        # a centre is a whole number of strides on
        centre = test.reach + (start - 2 * test.reach) // test.stride * test.stride
        window = slice(centre - test.reach, start + 1)
        if centre - test.reach >= first and max(starts)[0] - start <= test.reach and all(
                np.ptp(angle[window]) <= 2.0 * within for angle, within in shafts):
            yield Breakaway(centre, start, way)


def _start(angle: np.ndarray, within: float, first: int, end: int,
           reach: int) -> tuple[int, float] | None:
    """
    Return the last sample at which a shaft still rests, and which way it goes; None: it does not.

    A smoothed speed shows a start early, and the other way first.
    """
    level = float(np.median(angle[max(first, end - reach):end]))
    moved = angle[end:end + 2 * reach] - level
    far = np.flatnonzero(np.abs(moved) > within)
    return (end + int(far[0]) - 1, float(np.sign(moved[far[0]]))) if len(far) else None
