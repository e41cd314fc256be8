"""Topics joined by sequence number into one even grid, and what is wrong with them said."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .message_columns import Run

_SPARSE = 10
"""A grid this many times longer than its samples is not one recording."""

_TRIMMED = 0.1
"""Seconds that one topic may begin or end besides the others without a warning."""


class TimeError(ValueError):
    """Stamps or sequence numbers that cannot be those of one recording."""


@dataclass
class Track:
    """One topic, all its messages in the order of the file; ``values`` are flat over samples."""

    topic: str
    sequence: np.ndarray
    length: np.ndarray
    stamp: np.ndarray
    period: float
    values: dict[str, np.ndarray]
    constants: dict[str, np.ndarray]

    @property
    def end(self) -> int:
        """Running number after the last sample."""
        return int((self.sequence + self.length).max())

    def part(self, begin: int, end: int) -> Track:
        """Return messages number ``begin`` to ``end`` alone."""
        edges = np.concatenate(([0], np.cumsum(self.length)))
        chosen = slice(edges[begin], edges[end])
        return Track(self.topic, self.sequence[begin:end], self.length[begin:end],
                     self.stamp[begin:end], self.period,
                     {name: value[chosen] for name, value in self.values.items()}, self.constants)


def track(topic: str, runs: list[Run]) -> Track:
    """Put the runs of one topic together; raises TimeError when the period changes."""
    period = runs[0].period
    if not period > 0.0:
        raise TimeError(f'{topic}: period = {period} s, it must be positive')
    for run in runs:
        if run.period != period:
            raise TimeError(f'{topic}: period changes from {period} s to {run.period} s at '
                            f'sequence {run.sequence[0]}; record each rate in a bag of its own')
    sequence, stamp = (np.concatenate([getattr(run, name) for run in runs])
                       for name in ('sequence', 'stamp'))
    size = [next(iter(run.values.values())).shape[1] for run in runs]
    length = np.repeat(size, [len(run.sequence) for run in runs])
    columns = np.empty((len(runs[0].values), int(length.sum())))  # one piece: few page faults
    for name, column in zip(runs[0].values, columns, strict=True):
        np.concatenate([run.values[name].ravel() for run in runs], out=column)
    values = dict(zip(runs[0].values, columns, strict=True))
    return Track(topic, sequence, length, stamp, period, values, runs[-1].constants)


def stretches(item: Track) -> list[Track]:
    """
    Split a topic where its sequence starts again while time goes on (a restarted driver).

    Raises TimeError when time runs backwards, naming the place.
    """
    ahead, later = np.diff(item.sequence), np.diff(item.stamp)
    wrong = np.flatnonzero((ahead > 0) & (later <= 0))
    if len(wrong):
        k = wrong[0]
        raise TimeError(
            f'{item.topic}: time runs backwards from {item.stamp[k] / 1e9:.9f} s at sequence '
            f'{item.sequence[k]} to {item.stamp[k + 1] / 1e9:.9f} s at sequence '
            f'{item.sequence[k + 1]}; a clock was set back, or two rigs publish on this topic')
    edges = [0, *(np.flatnonzero((ahead < 0) & (later > 0)) + 1), len(item.sequence)]
    return [item.part(begin, end) for begin, end in zip(edges, edges[1:], strict=False)]


def join(tracks: list[Track], warnings: list[str]) -> tuple[int, int, dict[str, np.ndarray]]:
    """
    Return (first sequence, ns of that sample, columns) over the samples that all tracks span.

    A sample that a track lacks is NaN there; one that it has twice counts once, the first time.
    Both, and ends that not all tracks reach, are said in ``warnings``. Raises TimeError when the
    tracks do not overlap, differ in period or leave almost all samples out.
    """
    periods = {item.topic: item.period for item in tracks}
    if len(set(periods.values())) > 1:
        raise TimeError(f'topics of different periods {periods}, in s')
    begins = {item.topic: int(item.sequence.min()) for item in tracks}
    ends = {item.topic: item.end for item in tracks}
    first, end = max(begins.values()), min(ends.values())
    if first >= end:
        spans = {topic: (begins[topic], ends[topic] - 1) for topic in begins}
        raise TimeError(f'topics without a common sequence number: {spans}')
    present = min(int(item.length.sum()) for item in tracks)
    if end - first > _SPARSE * present:
        raise TimeError(f'sequence runs from {first} to {end - 1} with {present} samples only; '
                        'this is not one recording')
    period = tracks[0].period
    trimmed = max(max(ends.values()) - end, first - min(begins.values()))
    if trimmed * period > _TRIMMED:
        warnings.append(f'topics begin or end apart: {trimmed} samples at an end that not all '
                        f'topics have are left out ({trimmed * period:.3f} s)')
    columns: dict[str, np.ndarray] = {}
    for item in tracks:
        columns.update(_place(item, first, end, warnings))
    leader = max(tracks, key=lambda item: begins[item.topic])
    at = int(np.argmin(leader.sequence))
    _check_rate(leader, warnings)
    return first, int(leader.stamp[at]), columns


def _place(item: Track, first: int, end: int, warnings: list[str]) -> dict[str, np.ndarray]:
    edges = item.sequence + item.length
    if (item.sequence[1:] == edges[:-1]).all():
        begin = first - int(item.sequence[0])
        return {name: value[begin:begin + end - first] for name, value in item.values.items()}
    starts = np.cumsum(item.length) - item.length
    number = np.arange(int(item.length.sum())) + np.repeat(item.sequence - starts, item.length)
    stamps = item.stamp[np.argsort(item.sequence, kind='stable')]
    if (np.diff(stamps) < 0).any():
        k = int(np.argmax(np.diff(stamps) < 0))
        raise TimeError(f'{item.topic}: the same sequence numbers at different times near '
                        f'{stamps[k] / 1e9:.9f} s; these are several recordings in one')
    inside = np.flatnonzero((number >= first) & (number < end))[::-1]
    place = number[inside] - first
    seen = np.zeros(end - first, bool)
    seen[place] = True
    twice = len(inside) - int(seen.sum())
    if twice:
        warnings.append(f'{item.topic}: {twice} samples are there twice; the first is kept')
    lost = np.flatnonzero(~seen)
    if len(lost):
        gaps = 1 + int((np.diff(lost) > 1).sum())
        warnings.append(f'{item.topic}: {len(lost)} samples lost in {gaps} gaps, the first at '
                        f'sequence {first + lost[0]} ({lost[0] * item.period:.6g} s); '
                        'their rows are NaN')
    columns = {}
    for name, value in item.values.items():
        columns[name] = np.full(end - first, np.nan)
        columns[name][place] = value[inside]
    return columns


def _check_rate(item: Track, warnings: list[str]) -> None:
    samples = int(item.sequence[-1] - item.sequence[0])
    passed = (item.stamp[-1] - item.stamp[0]) / 1e9
    told = samples * item.period
    if abs(passed - told) > max(1e-3 * told, 2.0 * item.period):
        warnings.append(f'{item.topic}: {samples} samples of {item.period} s took {passed:.6g} s '
                        f'by their stamps where their period makes {told:.6g} s')
