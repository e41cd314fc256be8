"""Topics joined by sequence number into one even grid, and what is wrong with them said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .message_columns import Run

_SPARSE = 10
"""A grid this many times longer than its samples is not one recording."""

_TRIMMED = 0.1
"""Seconds that one topic may begin or end besides the others without a warning."""

SPAN = np.dtype([(name, np.int64) for name in (
    'piece', 'run', 'row', 'rows', 'size', 'first', 'last', 'end', 'stamp', 'late')]
    + [('period', np.float64)])
"""
Messages that follow each other without a gap, in one run of one piece of a bag.

They are ``rows`` from ``row`` on, of ``size`` samples. ``first`` and ``last`` are the sequence
numbers of the first and last message, ``end`` that after its last sample; ``stamp`` and ``late``
are the instants of both messages, ns; ``period`` is in s.
"""


class TimeError(ValueError):
    """Stamps or sequence numbers that cannot be those of one recording."""


@dataclass
class Track:
    """One topic: where its samples lie, SPAN by SPAN in the order of the file."""

    topic: str
    spans: np.ndarray

    @property
    def period(self) -> float:
        """Return the s from one sample to the next."""
        return float(self.spans['period'][0])

    @property
    def size(self) -> int:
        """Number of samples in all messages."""
        return int((self.spans['end'] - self.spans['first']).sum())


def spans_of(runs: list[Run], piece: int) -> np.ndarray:
    """Return where the messages of one topic in one piece of a bag follow each other."""
    found = []
    for number, run in enumerate(runs):
        broken = (np.diff(run.sequence) != run.size) | (np.diff(run.stamp) <= 0)
        begin = np.concatenate(([0], np.flatnonzero(broken) + 1))
        last = np.append(begin[1:], len(run.sequence)) - 1
        spans = np.empty(len(begin), SPAN)
        spans['piece'], spans['run'], spans['size'] = piece, number, run.size
        spans['period'] = run.period
        spans['row'], spans['rows'] = begin, last + 1 - begin
        spans['first'], spans['last'] = run.sequence[begin], run.sequence[last]
        spans['end'] = spans['last'] + run.size
        spans['stamp'], spans['late'] = run.stamp[begin], run.stamp[last]
        found.append(spans)
    return np.concatenate(found) if found else np.empty(0, SPAN)


def one_period(item: Track) -> Track:
    """Return a topic that has one period; raises TimeError where that changes."""
    periods = item.spans['period']
    for at in np.flatnonzero(np.diff(periods)) + 1:
        raise TimeError(
            f'{item.topic}: period changes from {periods[at - 1]} s to {periods[at]} s at '
            f'sequence {item.spans["first"][at]}; record each rate in a bag of its own')
    return item


def stretches(item: Track) -> list[Track]:
    """
    Split a topic where its sequence starts again (a restarted driver).

    By its stamps that is later than what came before, or at another instant than its numbers say:
    the clock was set back, as that of a simulation that begins again. Raises TimeError when time
    runs backwards while the numbers go on, or the period changes in between, naming the place.
    """
    spans = item.spans
    ahead = spans['first'][1:] - spans['last'][:-1]
    later = spans['stamp'][1:] - spans['late'][:-1]
    wrong = np.flatnonzero((ahead > 0) & (later <= 0))
    if len(wrong):
        one, other = spans[wrong[0]], spans[wrong[0] + 1]
        raise TimeError(
            f'{item.topic}: time runs backwards from {one["late"] / 1e9:.9f} s at sequence '
            f'{one["last"]} to {other["stamp"] / 1e9:.9f} s at sequence {other["first"]}; '
            'a clock was set back, or two rigs publish on this topic')
    own = ahead * spans['period'][:-1] * 1e9
    elsewhere = _elsewhere(own, later, spans['size'][:-1] * spans['period'][:-1] * 1e9)
    edges = [0, *(np.flatnonzero((ahead < 0) & ((later > 0) | elsewhere)) + 1), len(spans)]
    return [one_period(Track(item.topic, spans[begin:end])) for begin, end in pairwise(edges)]


def _elsewhere(own: np.ndarray, passed: np.ndarray, message: np.ndarray) -> np.ndarray:
    """Tell where another time has passed than numbers of one driver make, ns; see SPAN."""
    return np.abs(passed - own) > message + 1e-3 * np.abs(own)


def clocks_apart(one: Track, other: Track) -> float:
    """Return by how many s two topics differ in the instant of the same number."""
    begin, at = one.spans[0], other.spans[0]
    own = (at['first'] - begin['first']) * one.period
    return abs((at['stamp'] - begin['stamp']) / 1e9 - own)


def join(tracks: list[Track], warnings: list[str]) -> tuple[int, int, int]:
    """
    Return (first sequence, that after the last, ns of the first) that all tracks span.

    A sample that a track lacks is NaN there; one that it has twice counts once, the first time.
    Both, and ends that not all tracks reach, are said in ``warnings``. Raises TimeError when the
    tracks do not overlap, differ in period or leave almost all samples out.
    """
    periods = {item.topic: item.period for item in tracks}
    if len(set(periods.values())) > 1:
        raise TimeError(f'topics of different periods {periods}, in s')
    begins, ends = _reach(tracks)
    first, end = max(begins.values()), min(ends.values())
    if first >= end:
        spans = {topic: (begins[topic], ends[topic] - 1) for topic in begins}
        raise TimeError(f'topics without a common sequence number: {spans}')
    if sparse(tracks):
        raise TimeError(f'sequence runs from {first} to {end - 1} with '
                        f'{min(item.size for item in tracks)} samples only; this is not one '
                        'recording')
    period = tracks[0].period
    trimmed = max(max(ends.values()) - end, first - min(begins.values()))
    if trimmed * period > _TRIMMED:
        warnings.append(f'topics begin or end apart: {trimmed} samples at an end that not all '
                        f'topics have are left out ({trimmed * period:.3f} s)')
    for item in tracks:
        warnings += _holes(item, first, end)
    leader = max(tracks, key=lambda item: begins[item.topic])
    at = int(np.argmin(leader.spans['first']))
    warnings += _off_rate(leader)
    return first, end, int(leader.spans['stamp'][at])


def sparse(tracks: list[Track]) -> bool:
    """Tell whether topics leave almost all samples out of those that they span."""
    begins, ends = _reach(tracks)
    return min(ends.values()) - max(begins.values()) > _SPARSE * min(item.size for item in tracks)


def _reach(tracks: list[Track]) -> tuple[dict[str, int], dict[str, int]]:
    """Return by topic the number of the first sample, and that after the last."""
    return ({item.topic: int(item.spans['first'].min()) for item in tracks},
            {item.topic: int(item.spans['end'].max()) for item in tracks})


def _holes(item: Track, first: int, end: int) -> list[str]:
    """Say which samples are there twice or not at all; raises TimeError for two recordings."""
    spans = item.spans[np.argsort(item.spans['first'], kind='stable')]
    reached = np.maximum.accumulate(spans['end'])
    _check_one_time(item, spans, reached)
    said = []
    begin = np.clip(spans['first'], first, end)
    inside = int((np.clip(spans['end'], first, end) - begin).sum())
    before = np.clip(np.concatenate(([first], reached)), first, end)
    missing = np.maximum(0, np.append(begin, end) - before)
    lost = int(missing.sum())
    twice = inside - (end - first - lost)
    if twice:
        said.append(f'{item.topic}: {twice} samples are there twice; the first is kept')
    if lost:
        at = int(before[np.argmax(missing > 0)])
        said.append(f'{item.topic}: {lost} samples lost in {int((missing > 0).sum())} gaps, the '
                    f'first at sequence {at} ({(at - first) * item.period:.6g} s); '
                    'their rows are NaN')
    return said


def _check_one_time(item: Track, spans: np.ndarray, reached: np.ndarray) -> None:
    """Raise TimeError where the same sequence numbers, in their order, have different times."""
    furthest = np.maximum.accumulate(np.where(spans['end'] == reached, np.arange(len(spans)), 0))
    one, other = spans[furthest[:-1]], spans[1:]
    own = one['stamp'] + (other['first'] - one['first']) * (item.period * 1e9)
    message = one['size'] * (item.period * 1e9)
    apart = other['first'] >= one['end']
    wrong = np.where(apart, other['stamp'] < one['late'], _elsewhere(
        own - one['stamp'], other['stamp'] - one['stamp'], message))
    if wrong.any():
        raise TimeError(f'{item.topic}: the same sequence numbers at different times near '
                        f'{one["late"][np.argmax(wrong)] / 1e9:.9f} s; these are several '
                        'recordings in one')


def _off_rate(item: Track) -> list[str]:
    begin, end = item.spans[0], item.spans[-1]
    samples = int(end['last'] - begin['first'])
    passed = (end['late'] - begin['stamp']) / 1e9
    told = samples * item.period
    if abs(passed - told) <= max(1e-3 * told, 2.0 * item.period):
        return []
    return [f'{item.topic}: {samples} samples of {item.period} s took {passed:.6g} s by their '
            f'stamps where their period makes {told:.6g} s']


def place(item: Track, runs_of: RunsOf, first: int, end: int) -> dict[str, np.ndarray]:
    """
    Return the columns of one topic over the samples from ``first`` to ``end``, NaN where lost.

    ``runs_of(piece)`` gives the runs of the topic in a piece of the bag.
    """
    spans = item.spans
    columns: dict[str, np.ndarray] = {}
    for k in np.flatnonzero((spans['first'] < end) & (spans['end'] > first))[::-1]:
        piece, number, row, rows, size, begin, *_ = spans[k].tolist()
        run = runs_of(piece)[number]
        low = max(0, (first - begin) // size)
        high = min(rows, -(-(end - begin) // size))
        at = begin + low * size - first
        skip = max(0, -at)
        for name, values in run.values.items():
            flat = values[row + low:row + high].reshape(-1)[skip:end - first - at]
            column = columns.get(name)
            if column is None:
                column = columns[name] = np.full(end - first, np.nan)
            column[at + skip:at + skip + len(flat)] = flat
    return columns


RunsOf = Callable[[int], list[Run]]
