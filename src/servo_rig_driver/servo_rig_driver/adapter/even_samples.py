"""Messages that come when they come, brought onto an even grid of samples."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import nan

from ..driver.sample_blocks import COLUMNS

HOLE = 3.0
"""Periods between two messages of a topic beyond which nothing is interpolated."""
LONGEST = 300_000_000
"""For how many ns a sample waits at most for the next message of a topic that comes seldom."""
KEPT = 10_000_000_000
"""For how many ns the messages of a topic are kept while the leading one is silent."""


class Track:
    """What came of one topic, in order: times in ns, one value for each of its ``places``."""

    def __init__(self, places: Sequence[int], held: Sequence[bool]) -> None:
        self.places = tuple(places)
        self.held = tuple(held)
        self.times: list[int] = []
        self.rows: list[Sequence[float]] = []
        self.span = 0.0
        """Usual ns from one message to the next: a mean that forgets, 0 before the second."""
        self.back = self.repeated = 0
        """Messages before the last one in time; of its very time, and with other values."""

    def put(self, time: int, row: Sequence[float]) -> bool:
        """Take a message; one that is not newer than the last one is not taken."""
        if self.times and time <= self.times[-1]:
            self.back += time < self.times[-1]
            self.repeated += time == self.times[-1] and list(row) != list(self.rows[-1])
            return False
        if self.times:
            step = time - self.times[-1]
            # a hole is not usual, and one long step must not make it so
            self.span += ((min(step, 2.0 * self.span) - self.span) / 32.0
                          if self.span else step)
        self.times.append(time)
        self.rows.append(row)
        self.forget(time - KEPT)
        return True

    def fill(self, instant: int, longest: float, into: list[float]) -> None:
        """Write the values at an instant; NaN where nothing is known or a hole is."""
        at = bisect_right(self.times, instant) - 1
        if at < 0:
            return
        before, exact = self.rows[at], self.times[at] == instant
        after = self.rows[at + 1] if at + 1 < len(self.times) else None
        step = self.times[at + 1] - self.times[at] if after is not None else 0
        share = (instant - self.times[at]) / step if step else 0.0
        for place, held, value, then in zip(self.places, self.held, before, after or before,
                                            strict=True):
            if held or exact:
                into[place] = value
            elif after is not None and step <= longest:
                into[place] = value + share * (then - value)

    def forget_all(self) -> None:
        """Forget every message: the clock that stamps them was set."""
        self.times.clear()
        self.rows.clear()

    def forget(self, instant: int) -> None:
        """Forget what no later instant needs."""
        at = bisect_right(self.times, instant) - 1
        if at > 256:
            del self.times[:at], self.rows[:at]


class EvenSamples:
    """
    Samples ``period`` ns apart, number k at ``origin + k * period``.

    ``tracks`` are the topics by name, ``leading`` the one whose messages make the samples.
    Measured columns are interpolated between two messages of their topic, commands hold. A sample
    waits ``delay`` ns for the other topics, and for the next message of those that are measured:
    two of their usual steps more, up to LONGEST. In a hole of the leading topic there are no
    samples: ``missing`` counts. ``late`` counts messages that were not newer than the last one.
    """

    def __init__(self, tracks: Mapping[str, Track], leading: str, origin: int, period: int,
                 delay: int, constants: Mapping[str, float]) -> None:
        self.tracks = dict(tracks)
        self.leading = self.tracks[leading]
        self.others = [track for name, track in self.tracks.items() if name != leading]
        self.origin, self.period, self.delay = origin, period, delay
        self.number = self.missing = 0
        self._blank = [constants.get(name, nan) for name in COLUMNS]

    def take(self, now: int) -> Iterator[tuple[int, list[float]]]:
        """Give the samples that are complete at ``now`` ns, with their numbers."""
        lead = self.leading
        while lead.times:
            instant = self.origin + self.number * self.period
            if lead.times[-1] < instant or not self._complete(instant, now):
                return
            at = bisect_right(lead.times, instant) - 1
            if at < 0 or (lead.times[at] < instant and lead.times[at + 1] - lead.times[at]
                          > HOLE * max(self.period, lead.span)):
                self._pass_over(lead.times[at + 1])
                continue
            row = list(self._blank)
            for track in self.tracks.values():
                track.fill(instant, HOLE * max(self.period, track.span), row)
            yield self.number, row
            self.number += 1
            for track in self.tracks.values():
                track.forget(instant)

    def _complete(self, instant: int, now: int) -> bool:
        return all(now >= instant + self._patience(track)
                   or (track.times and track.times[-1] >= instant) for track in self.others)

    def _patience(self, track: Track) -> float:
        seldom = 0.0 if all(track.held) else min(2.0 * track.span, LONGEST)
        return self.delay + seldom

    def _pass_over(self, until: int) -> None:
        """Go on with the first sample that is not before ``until``; those between are missing."""
        ahead = -(-(until - self.origin) // self.period)
        self.missing += ahead - self.number
        self.number = ahead


def usual_step(times: Sequence[int]) -> int:
    """
    Return the ns between the messages of a topic, from at least two times.

    A lost message leaves a step of two periods, and a loop that was held up makes up for it in
    steps of none: steps count as so many whole periods, by their median. Where that makes more
    than two periods of a message, they came in bursts, and count by their number. A control loop
    runs at a round rate, and a busy machine makes it look like another: one with a single digit
    within 2 % is taken, or one with two digits within 0.5 %, else three digits.
    """
    steps = sorted(after - before for before, after in pairwise(times))
    middle = steps[len(steps) // 2]
    periods = sum(round(step / middle) for step in steps)
    if periods > 2 * len(steps):
        periods = len(steps)
    rate = 1e9 * periods / (times[-1] - times[0])
    for digits, off in ((1, 0.02), (2, 0.005)):
        round_one = float(f'{rate:.{digits}g}')
        if abs(round_one - rate) <= off * rate:
            return round(1e9 / round_one)
    return round(1e9 / float(f'{rate:.3g}'))
