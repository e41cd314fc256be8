"""The samples of one rig in a bag: where they lie, and any part of them as columns."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
import os
from typing import Any

import numpy as np

from .bag_writing import BagError
from .driver_lives import lives, parted
from .mcap_reading import DAMAGE
from .message_columns import decode, Run
from .message_definitions import embedded_types
from .message_sources import Source
from .sample_grid import join, one_period, place, SPAN, spans_of, stretches, TimeError, Track

_SEVERAL = 1000  # arrays of spans that are put into one
ALIKE = 0.99  # share of the longest stretch from which another one is as long
_BATCH = 8  # pieces for each core that are read before what was found is gathered


Noted = dict[str, tuple[np.ndarray, list[Run]]]
"""By topic: where its messages in a piece of a bag lie, and its runs without their samples."""


class _Gathered:
    """Where the messages of some topics lie, as it is found piece by piece."""

    def __init__(self, topics: list[str]) -> None:
        self._spans = {topic: [np.empty(0, SPAN)] for topic in topics}
        self._periods: dict[str, float] = {}
        self.constants: dict[str, Any] = {}

    def add(self, noted: Noted) -> None:
        """Take in a piece; raises TimeError for a period that is none."""
        for topic, (lie, heads) in noted.items():
            several = self._spans[topic]
            several.append(lie)
            if len(several) > _SEVERAL:  # an array costs more than what is in it
                several[:] = [np.concatenate(several)]
            for run in heads:
                if not run.period > 0.0:
                    raise TimeError(f'{topic}: period = {run.period} s, it must be positive')
                self._periods.setdefault(topic, run.period)
            self.constants |= heads[-1].constants if heads else {}

    def add_alike(self, noted: Noted) -> bool:
        """Take in a piece if it has the periods that are known; say whether it was taken in."""
        alike = bool(noted) and all(
            run.period > 0.0 and self._periods.get(topic, run.period) == run.period
            for topic, (_, heads) in noted.items() for run in heads)
        if alike:
            self.add(noted)
        return alike

    def irregular(self) -> set[int]:
        """Return the pieces after which a topic goes on otherwise than the piece's count tells."""
        found = set[int]()
        for item in self.tracks():
            lie = item.spans
            follows = (lie['first'][1:] == lie['end'][:-1]) & (lie['stamp'][1:] > lie['late'][:-1])
            found.update(lie['piece'][:-1][~follows].tolist(), lie['piece'][:1].tolist(),
                         lie['piece'][-1:].tolist())
        return found

    def drop(self, pieces: set[int]) -> None:
        """Forget pieces."""
        for several in self._spans.values():
            spans = np.concatenate(several)
            several[:] = [spans[~np.isin(spans['piece'], sorted(pieces))]]

    def tracks(self) -> list[Track]:
        """Return the topics, in the order of the bag."""
        joined = {topic: np.concatenate(several) for topic, several in self._spans.items()}
        return [Track(topic, spans[np.argsort(spans['piece'], kind='stable')])
                for topic, spans in joined.items()]


class RigSamples:
    """
    Topics of one rig, joined into one even grid.

    A first pass over the bag notes where the messages lie, and keeps no sample. Of a chunk it sees
    the first message and the count of all: where the next chunk begins as they tell, the chunk is
    taken to be without a gap. Else it is read. Each is held against its messages when its samples
    are wanted, so that :attr:`warnings` are complete once all parts were read.

    ``sequence`` is the running number of the first sample, ``end`` that after the last, ``stamp``
    the instant of the first in ns, ``period`` in s; ``constants`` holds what the last messages say
    besides. ``topics`` are full names. Raises BagError for topics that make no recording.
    """

    def __init__(self, source: Source, topics: list[str], stretch: int | None) -> None:
        self._source, self._topics = source, topics
        self._cores = len(os.sched_getaffinity(0)) if source.parallel else 1
        self._pieces = list(source.pieces(topics))
        self._open: dict[int, dict[str, list[Run]]] = {}
        self._assumed: set[int] = set()
        self._damaged: list[str] = []
        self._said: list[str] = []
        self.constants: dict[str, Any] = {}
        try:
            known = [part for life in lives(self._tracks(), self._said) for part in parted(life)]
            self._chosen = _choose(known, stretch, self._said)
            self.sequence, self.end, self.stamp = join(self._chosen, [])
        except TimeError as error:
            raise BagError(f'{source.path}: {error}') from None
        self.period = self._chosen[0].period

    @property
    def warnings(self) -> list[str]:
        """What is to be said of the samples, as far as they were read."""
        said: list[str] = []
        join(self._chosen, said)
        return [*self._damaged, *self._said, *said]

    def clipped(self, first: int, end: int) -> tuple[int, int]:
        """Return the running numbers from ``first`` to ``end`` as far as there are samples."""
        first = min(max(first, self.sequence), self.end)
        return first, max(first, min(end, self.end))

    def part(self, first: int, end: int) -> dict[str, dict[str, np.ndarray]]:
        """Return by topic the fields over samples number ``first`` to ``end``, NaN where lost."""
        wanted = {int(piece) for item in self._chosen for piece in np.unique(item.spans['piece'][
            (item.spans['first'] < end) & (item.spans['end'] > first)])}
        self._open = {piece: self._open[piece] for piece in wanted & self._open.keys()}
        missing = sorted(wanted - self._open.keys())
        for piece, runs in zip(missing, self._each(self._loaded, missing), strict=True):
            self._open[piece] = {} if isinstance(runs, str) else runs
            if piece in self._assumed:
                self._settle(piece, runs)
        return {item.topic: place(item, lambda piece, item=item: self._open[piece][item.topic],
                                  first, end) for item in self._chosen}

    def _settle(self, piece: int, runs: dict[str, list[Run]] | str) -> None:
        """Put where the messages of a piece do lie in place of what was assumed."""
        self._assumed.remove(piece)
        if isinstance(runs, str):
            self._damaged.append(runs)
            runs = {}
        try:
            for item in self._chosen:
                own = np.flatnonzero(item.spans['piece'] == piece)
                if len(own):
                    found = spans_of(runs.get(item.topic, []), piece)
                    item.spans = np.concatenate((item.spans[:own[0]], found,
                                                 item.spans[own[-1] + 1:]))
                    stretches(one_period(item))  # raises where time runs backwards
            join(self._chosen, [])
        except TimeError as error:
            raise BagError(f'{self._source.path}: {error}') from None

    def _tracks(self) -> list[Track]:
        found = _Gathered(self._topics)
        every = range(len(self._pieces))
        glanced = self._each(self._glanced, every)
        unsure = {piece for piece, noted in zip(every, glanced, strict=True)
                  if not found.add_alike(noted)}
        unsure |= found.irregular()
        self._assumed = set(every) - unsure
        found.drop(unsure)
        for noted in self._each(self._read, sorted(unsure)):
            if isinstance(noted, str):
                self._damaged.append(noted)
            else:
                found.add(noted)
        self.constants = found.constants
        tracks = found.tracks()
        empty = [item.topic for item in tracks if not len(item.spans)]
        if empty:
            raise BagError(f'{self._source.path}: no message on {", ".join(empty)}'
                           + ''.join(f'; {warning}' for warning in self._damaged))
        return tracks

    def _glanced(self, piece: int) -> Noted:
        """Return where messages lie if they follow the first one; empty where none was seen."""
        found: Noted = {}
        try:
            for channel, count, payload in self._source.glance(self._pieces[piece], self._topics):
                types = embedded_types(channel.kind, channel.encoding, channel.definition)
                run, = decode(types, channel.kind, payload)
                if run.size:
                    lie = spans_of([run], piece)
                    lie['rows'] = count
                    lie['last'] += (count - 1) * run.size
                    lie['end'] += (count - 1) * run.size
                    lie['late'] += round((count - 1.5) * run.size * run.period * 1e9)
                    found[channel.topic] = lie, [run.head()]
        except DAMAGE:
            return {}  # what is wrong is said when it is read
        return found

    def _read(self, piece: int) -> Noted | str:
        """Return where the messages in a piece lie, or how it is damaged."""
        runs = self._loaded(piece)
        return runs if isinstance(runs, str) else {
            topic: (spans_of(several, piece), [run.head() for run in several])
            for topic, several in runs.items()}

    def _loaded(self, piece: int) -> dict[str, list[Run]] | str:
        try:
            return self._runs(piece)
        except DAMAGE as error:
            where = self._source.describe(self._pieces[piece])
            return f'{where} is damaged and left out: {error}'

    def _runs(self, piece: int) -> dict[str, list[Run]]:
        found: dict[str, list[Run]] = {}
        for channel, rows in self._source.load(self._pieces[piece], self._topics):
            types = embedded_types(channel.kind, channel.encoding, channel.definition)
            found.setdefault(channel.topic, []).extend(
                run for payloads in rows for run in decode(types, channel.kind, payloads)
                if run.size)
        return found

    def _each(self, function: Any, pieces: Iterable[int]) -> Iterable[Any]:
        """Yield what a function says of pieces, in their order, a few ahead on all cores."""
        pieces = list(pieces)
        if self._cores == 1 or len(pieces) < 2:
            yield from map(function, pieces)
            return
        with ThreadPoolExecutor(self._cores) as pool:
            for at in range(0, len(pieces), _BATCH * self._cores):
                yield from pool.map(function, pieces[at:at + _BATCH * self._cores])


def _choose(known: list[list[Track]], stretch: int | None, warnings: list[str]) -> list[Track]:
    if stretch is not None and not 0 <= stretch < len(known):
        raise TimeError(f'stretch = {stretch} is outside of [0, {len(known) - 1}]')
    if len(known) == 1:
        return known[0]
    sizes = [min(part.size for part in life) for life in known]
    if stretch is None:
        # what rig and twin say may differ by some samples: the first of those that are alike
        stretch = int(np.argmax(np.array(sizes) >= ALIKE * max(sizes)))
        rates = [f'{1.0 / life[0].period:.6g}' for life in known]
        at = f' at {", ".join(rates)} Hz' if len(set(rates)) > 1 else ''
        warnings.append(f'the driver was restarted, or paused, while recording: stretches of '
                        f'{sizes} samples{at}; number {stretch} is read')
    return known[stretch]
