"""From messages of several topics to blocks of even samples; no ROS, times are handed in as ns."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from math import isnan
from typing import Any

from ..driver.sample_blocks import BlockBuilder, COLUMNS, SampleBlock
from .clock_offset import ClockOffset
from .even_samples import EvenSamples, Track, usual_step
from .mapped_columns import HELD, MappedColumns, SHORTEST

SECOND = 1_000_000_000
BACK = SECOND  # ns that the leading topic may jump before the samples begin again
LEAST = 8  # messages of the leading topic before the samples begin
UNLIKE = 1.2  # from how many times slower or faster messages are of another rate


class SampleStream:
    """
    Listens for ``listen`` ns, then hands blocks of samples to ``out``.

    ``period`` ns, 0: that of the leading topic; ``given`` remembers it as it was. The samples
    begin again, from number 0, when the leading topic's time jumps back or its clock is set:
    ``restarts`` counts. Of another topic all is forgotten then, since what it said by the clock
    before may lie ahead of all that is to come. The samples begin again, too, where the leading
    topic comes at another rate for twice ``listen`` ns and ``given`` is 0: ``rates`` counts.
    ``blank`` counts the samples without a number by the measured columns of the other topics.
    """

    def __init__(self, mapped: MappedColumns, period: int, listen: int, delay: int, size: int,
                 out: Callable[[SampleBlock], None]) -> None:
        self.mapped = mapped
        self.topics = mapped.topics
        self.period = period
        self.restarts = self.rates = self.samples = self.late = 0
        self.given = period
        self._listen, self._delay, self._size, self._out = listen, delay, size, out
        self.clocks = {topic: ClockOffset() for topic in self.topics}
        self._lost = 0
        self.blank = {column.name: 0 for topic, columns in self.topics.items()
                      if topic != mapped.leading for column in columns if column.name not in HELD}
        self._places = {COLUMNS.index(name): name for name in self.blank}
        self._begin()

    @property
    def lost(self) -> int:
        """Samples left out: in holes of the leading topic, or of a block that a hole cut."""
        return self._lost + (self._even.missing + self._blocks.dropped if self._even else 0)

    @property
    def running(self) -> bool:
        """Whether it has listened long enough."""
        return self._even is not None

    def _begin(self) -> None:
        self._tracks = {topic: Track([COLUMNS.index(column.name) for column in columns],
                                     [column.name in HELD for column in columns])
                        for topic, columns in self.topics.items()}
        self._first: dict[str, float] = {}
        self._even: EvenSamples | None = None
        self._blocks: BlockBuilder | None = None
        self._since: int | None = None
        self._looked = self._other = 0  # when its rate was measured last, a period unlike ours

    def put(self, topic: str, message: Any, stamp: int, received: int) -> list[float]:
        """
        Take a message with its stamp, 0 for none, and the instant of its receipt.

        Returns the values of the topic's columns, NaN where it holds none. Raises FieldError when
        it lacks a field that the mapping names.
        """
        row = [self._zeroed(column, column.of(message)) for column in self.topics[topic]]
        clock = self.clocks[topic]
        if clock.stray(stamp, received):
            return row
        jumps = clock.jumps
        time = clock.local(stamp, received)
        track = self._tracks[topic]
        back = bool(track.times) and time < track.times[-1] - BACK
        if back or clock.jumps != jumps:
            track = self._set_back(topic, track)
        if not track.put(time, row):
            self.late += 1
        if topic == self.mapped.leading:
            self._advance(received)
        return row

    def _set_back(self, topic: str, track: Track) -> Track:
        """Return the empty track of a topic whose time jumped; the leading one begins all."""
        if topic == self.mapped.leading:
            self._lost = self.lost
            self.restarts += 1
            self._begin()
            return self._tracks[topic]
        track.forget_all()
        return track

    def _zeroed(self, column: Any, value: float) -> float:
        if not column.from_first:
            return value
        if column.name not in self._first and not isnan(value):
            self._first[column.name] = value
        return value - self._first.get(column.name, 0.0)

    def _advance(self, now: int) -> None:
        times = self._tracks[self.mapped.leading].times
        if self._even is None:
            self._since = self._since or now
            if now - self._since < self._listen or len(times) < LEAST:
                return
            period = self.given or usual_step(times)
            if period < SHORTEST * SECOND:  # of a clock at another pace, which is told
                return
            self._sample_from(times[-1], period)
        elif not self.given:
            self._follow_rate(times)
        for number, row in self._even.take(now):
            self._blocks.add(number, row)
            self.samples += 1
            for place, name in self._places.items():
                self.blank[name] += isnan(row[place])

    def _sample_from(self, origin: int, period: int) -> None:
        self.period, self._looked, self._other = period, origin, 0
        self._even = EvenSamples(self._tracks, self.mapped.leading, origin, period,
                                 self._delay, self.mapped.constants)
        self._blocks = BlockBuilder(self._size, origin, period, self._out)

    def _follow_rate(self, times: list[int]) -> None:
        """Begin again at another rate that two looks in turn find: a busy robot has hiccups."""
        fresh = times[bisect_left(times, self._looked):]
        if times[-1] - self._looked < self._listen or len(fresh) < LEAST:
            return
        self._looked, period, other = times[-1], usual_step(fresh), self._other
        self._other = 0 if _alike(period, self.period) else period
        if self._other and other and _alike(period, other):
            self._lost = self.lost
            self.rates += 1
            self._sample_from(times[-1], period)

    def disorder(self, topic: str) -> dict[str, int]:
        """Return how many messages of a topic were left out for their time, by why."""
        track = self._tracks[topic]
        return {'going back in time': track.back,
                'repeating the time of the one before with other values': track.repeated,
                'being more than 1 s off the others': self.clocks[topic].strays}

    def usual_period(self, topic: str) -> float:
        """Return the s from one message of a topic to the next, 0.0 while not known."""
        return self._tracks[topic].span * 1e-9


def _alike(one: int, other: int) -> bool:
    return max(one, other) <= UNLIKE * min(one, other)
