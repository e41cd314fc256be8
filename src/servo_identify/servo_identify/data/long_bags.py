"""Recordings too long to be held: what is looked at of one, and one whose columns are on disk."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
import shutil
import tempfile

import numpy as np

from servo_twin.bag import BagError, OpenRecording
from servo_twin.recording.parts import parts_of
from servo_twin.recording.recording import COLUMNS, Recording

from .on_disk import OnDisk

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
        return [all_of(one)]
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


def all_of(one: Long) -> Recording:
    """
    Return a recording with all its samples; of one longer than LONGEST the columns are on disk.

    They lie in files without a name, in the folder for temporary files (TMPDIR), and cannot be
    changed. Their pages are read as they are used, and taken back where memory is short. Raises
    BagError where that disk has no room for them.
    """
    if isinstance(one, Recording):
        return one
    if len(one) <= LONGEST:
        whole = one.part(one.sequence, one.sequence + len(one))
        return replace(whole, warnings=one.warnings, digest=one.digest)
    folder, needed = tempfile.gettempdir(), 8 * len(COLUMNS) * len(one)
    free = shutil.disk_usage(folder).free
    if needed > free:
        raise BagError(f'{one.name}: its {len(one)} samples take {needed / 2**30:.1f} GiB in '
                       f'{folder} and {free / 2**30:.1f} GiB are free; let TMPDIR name a folder '
                       'on a larger disk')
    with ExitStack() as files:
        columns = {name: OnDisk(files.enter_context(tempfile.TemporaryFile(dir=folder)), 'd')
                   for name in COLUMNS}
        for part in parts_of(one):
            for name, column in columns.items():
                column.extend(part[name])
        whole = one.part(one.sequence, one.sequence)
        return replace(whole, columns={name: column.mapped() for name, column in columns.items()},
                       warnings=one.warnings, digest=one.digest)


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
