"""What an adapter finds wrong with topics, samples and clocks, told to its health."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import monotonic

from ..driver.rig_health import Level, RigHealth
from .sample_stream import SampleStream, SECOND
from .topic_watch import TopicWatch

AHEAD = 20_000_000
"""ns by which no stamp of our own clock is ahead of its receipt, nor of a simulated one."""
MANY = 0.1
"""Share of the samples that may lack a column of another topic, as where one message is lost."""


class AdapterFindings:
    """
    Looks at a stream of samples and at the topics that it is made of; ``watches`` by topic.

    ``named`` returns what people know a topic by, which is its name after remaps.
    """

    def __init__(self, stream: SampleStream, health: RigHealth,
                 named: Callable[[str], str] = str) -> None:
        self._stream, self._health, self._named = stream, health, named
        self.watches = {topic: TopicWatch(columns) for topic, columns in stream.topics.items()}
        self._told = {'lost': 0, 'restarts': 0, 'rates': 0}
        self._samples, self._blank = 0, dict.fromkeys(stream.blank, 0)
        self._disorder: dict[str, dict[str, int]] = {}
        self._stamps = {topic: (0, 0) for topic in stream.topics}
        self._time = 0, monotonic()  # the last ROS time that was new, and when that was

    def tell(self, publishers: Mapping[str, Sequence[str]], now: int) -> None:
        """Tell what came since the last time; ``publishers`` by topic, ``now`` in ns."""
        leading = self._named(self._stream.mapped.leading)
        self._tell_new('lost', self._stream.lost, 'samples.lost', 'samples left out: '
                       f'messages of {leading} are missing', now)
        self._tell_new('restarts', self._stream.restarts, 'clock.restart', 'times that the '
                       f'samples began again: the time of {leading} jumped', now)
        rate = SECOND / self._stream.period if self._stream.period else 0.0
        self._tell_new('rates', self._stream.rates, 'samples.rate', 'times that the samples began '
                       f'again: {leading} comes at another rate, by now {rate:.4g} Hz', now)
        late = self._late()
        for topic, names in publishers.items():
            told = self.watches[topic].report(names)
            found = told | self._pace(topic) | self._ahead(topic) | self._unset(topic)
            found |= self._order(topic) | {
                f'{name} late': said for name, said in late.items()
                if name not in told and name in [one.name for one in self._stream.topics[topic]]}
            known = self._named(topic)
            self._health.keep(f'topics.{topic}.', {
                key: (level, f'{known}: {said}') for key, (level, said) in found.items()}, now)

    def _tell_new(self, what: str, count: int, key: str, text: str, now: int) -> None:
        if count > self._told[what]:
            self._health.event(key, f'{count - self._told[what]} {text}', now)
            self._told[what] = count

    def _pace(self, topic: str) -> dict[str, tuple[Level, str]]:
        """Return what is to be said of a topic whose clock goes at another pace than ours."""
        pace = self._stream.clocks[topic].pace
        return {} if pace == 1.0 else {'pace': (Level.ERROR, (
            f'its stamps go at {pace:.2g} of our time; beside a simulation set use_sim_time, '
            'else set the stamps, or leave them zero'))}

    def _ahead(self, topic: str) -> dict[str, tuple[Level, str]]:
        """Return what is to be said of stamps before our clock, where another topic has others."""
        least = {name: clock.least for name, clock in self._stream.clocks.items()
                 if clock.least is not None and not clock.offset}
        if topic not in least or least[topic] > -AHEAD or max(least.values()) < (
                least[topic] + AHEAD):
            return {}
        other = self._named(max(least, key=lambda name: least[name]))
        return {'ahead': (Level.WARN, (
            f'its stamps are {least[topic] * -1e-6:.3g} ms before our clock, and those of {other} '
            'are not. Less than 0.1 s is left as it is, so that the columns of the two do not '
            'belong together; synchronize the clocks of the machines'))}

    def _unset(self, topic: str) -> dict[str, tuple[Level, str]]:
        """Return what is to be said where some messages had no stamp, and others had one."""
        clock, (taken, unset) = self._stream.clocks[topic], self._stamps[topic]
        self._stamps[topic] = clock.taken, clock.unset
        taken, unset = clock.taken - taken, clock.unset - unset
        return {'unset': (Level.WARN, (
            f'{unset} of {taken} messages had no stamp and count by their receipt, the others by '
            'their stamp; does one node publish it?'))} if 0 < unset < taken else {}

    def _late(self) -> dict[str, tuple[Level, str]]:
        """Return what is to be said of columns that many samples since the last time lack."""
        samples = self._stream.samples - self._samples
        blank = {name: count - self._blank[name] for name, count in self._stream.blank.items()}
        self._samples, self._blank = self._stream.samples, dict(self._stream.blank)
        return {name: (Level.WARN, (
            f'{name}: {count} of {samples} samples hold no number, since its messages come later '
            'than a sample waits for them, or too seldom to interpolate; raise delay'))
            for name, count in blank.items() if count > MANY * samples}

    def _order(self, topic: str) -> dict[str, tuple[Level, str]]:
        """Return what is to be said of messages that were left out since the last time."""
        before = self._disorder.get(topic, {})
        self._disorder[topic] = now = self._stream.disorder(topic)
        new = {why: count - before.get(why, 0) for why, count in now.items()}
        return {f'order {why}': (Level.WARN, (
            f'{count} of its messages left out for {why}; does one node publish it, and stamp '
            'each message by itself?')) for why, count in new.items() if count > 0}

    def tell_time(self, now: int, silence: float) -> None:
        """Tell where ROS time has stood still for ``silence`` s, as beside a paused simulation."""
        if now != self._time[0]:
            self._time = now, monotonic()
        if monotonic() - self._time[1] <= silence:
            self._health.over('clock.stands', now)
        elif now:
            self._health.trouble('clock.stands', '/clock stands still: the simulation is paused '
                                 'or has ended', now, Level.WARN)
        else:
            self._health.trouble('clock.stands', 'use_sim_time is set, and nobody publishes '
                                 '/clock: there are no samples', now)
