"""What is looked at of a recording that is too long to be held: parts of it, by a stated rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from servo_twin.bag import OpenRecording
from servo_twin.recording.parts import parts_of
from servo_twin.recording.recording import Recording

LONGEST = 300_000  # samples that are held at once: five minutes at 1 kHz, 2.6 GB in a diagnosis
CHOSEN = 10  # parts that are taken of a longer recording, as long together as the longest
APART = 0.1  # s between the samples of which the travel is summed, so that noise adds little

Long = OpenRecording | Recording
"""A recording in an open bag, of any length, or one in memory."""


def looked_at(one: Long) -> list[Recording]:
    """
    Return what is looked at of a recording: all of it, or parts of one longer than LONGEST.

    Its parts make CHOSEN groups that follow each other. Of each group the part of most travel is
    taken, the earliest of several. What was taken, and how much was left, stands in the warnings
    of the first.
    """
    if len(one) <= LONGEST:
        whole = one.part(one.sequence, one.sequence + len(one))
        return [replace(whole, warnings=one.warnings, digest=one.digest)]
    best: dict[int, tuple[float, int, Recording]] = {}
    size = LONGEST // CHOSEN
    count = -(-len(one) // size)
    for number, part in enumerate(parts_of(one, size)):
        group, travel = number * CHOSEN // count, travel_of(part)
        if group not in best or travel > best[group][0]:
            best[group] = (travel, number, part)
    digest = one.digest
    taken = [replace(part, name=f'{one.name}[{span_of(one, part)}]', digest=digest, warnings=())
             for _, _, part in best.values()]
    taken[0] = replace(taken[0], warnings=(*one.warnings, _said(one, taken, count)))
    return taken


def span_of(one: Long, part: Recording) -> str:
    """Return from which to which second of a recording a part goes."""
    begin = (part.sequence - one.sequence) * one.period
    return f'{begin:.6g}-{begin + part.duration:.6g} s'


def travel_of(part: Recording) -> float:
    """Return how far the shafts turned, to and fro, rad: both angles on their own shafts."""
    step = max(1, round(APART / part.period))
    return sum(float(np.nansum(np.abs(np.diff(part[name][::step]))))
               for name in ('motor_position', 'load_position'))


def _said(one: Long, taken: Sequence[Recording], count: int) -> str:
    spans = [span_of(one, part) for part in taken]
    left = one.duration - sum(part.duration for part in taken)
    return (f'{one.name} is longer than the {LONGEST} samples that are held at once: of its '
            f'{count} parts of {taken[0].duration:.6g} s {len(spans)} are taken, in each of '
            f'{len(spans)} equal stretches that of most travel ({", ".join(spans)}); '
            f'{left:.6g} s of {one.duration:.6g} s are left')
