"""The samples of one rig in a bag: where they lie, and any part of them as columns."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
import os
from typing import Any

import numpy as np

from .bag_writing import BagError
from .mcap_reading import DAMAGE
from .message_columns import decode, Run
from .message_definitions import embedded_types
from .message_sources import Source
from .sample_grid import join, one_period, place, SPAN, spans_of, stretches, TimeError, Track

_BATCH = 8  # pieces for each core that are read before their spans are gathered


class RigSamples:
    """
    Topics of one rig, joined into one even grid.

    A first pass over the bag notes where the messages lie, and keeps no sample. ``sequence`` is
    the running number of the first sample, ``end`` that after the last, ``stamp`` the instant of
    the first in ns, ``period`` in s; ``constants`` holds what the last messages say besides.
    ``topics`` are full names. Raises BagError for topics that make no recording.
    """

    def __init__(self, source: Source, topics: list[str], stretch: int | None,
                 warnings: list[str]) -> None:
        self._source, self._topics = source, topics
        self._cores = len(os.sched_getaffinity(0)) if source.parallel else 1
        self._pieces = list(source.pieces(topics))
        self._open: dict[int, dict[str, list[Run]]] = {}
        self.constants: dict[str, Any] = {}
        try:
            parts = {item.topic: stretches(item) for item in self._tracks(warnings)}
            self._chosen = _choose(parts, stretch, warnings)
            self.sequence, self.end, self.stamp = join(self._chosen, warnings)
        except TimeError as error:
            raise BagError(f'{source.path}: {error}') from None
        self.period = self._chosen[0].period

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
        self._open |= zip(missing, self._each(self._runs, missing), strict=True)
        return {item.topic: place(item, lambda piece, item=item: self._open[piece][item.topic],
                                  first, end) for item in self._chosen}

    def _tracks(self, warnings: list[str]) -> list[Track]:
        spans = {topic: [np.empty(0, SPAN)] for topic in self._topics}
        periods: dict[str, float | None] = dict.fromkeys(self._topics)
        for found in self._each(self._noted, range(len(self._pieces))):
            if isinstance(found, str):
                warnings.append(found)
                continue
            for topic, (lie, heads) in found.items():
                spans[topic].append(lie)
                periods[topic] = one_period(topic, heads, periods[topic])
                self.constants |= heads[-1].constants if heads else {}
        tracks = [Track(topic, periods[topic] or 0.0, np.concatenate(several))
                  for topic, several in spans.items()]
        empty = [item.topic for item in tracks if not len(item.spans)]
        if empty:
            raise BagError(f'{self._source.path}: no message on {", ".join(empty)}'
                           + ''.join(f'; {warning}' for warning in warnings))
        return tracks

    def _noted(self, piece: int) -> dict[str, tuple[np.ndarray, list[Run]]] | str:
        """Return by topic where its messages in a piece lie, and the runs' heads."""
        try:
            return {topic: (spans_of(runs, piece), [run.head() for run in runs])
                    for topic, runs in self._runs(piece).items()}
        except DAMAGE as error:
            place = self._source.describe(self._pieces[piece])
            return f'{place} is damaged and left out: {error}'

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


def _choose(parts: dict[str, list[Track]], stretch: int | None,
            warnings: list[str]) -> list[Track]:
    counts = {topic: len(items) for topic, items in parts.items()}
    if len(set(counts.values())) > 1:
        raise TimeError(f'sequence numbers start again a different number of times: {counts}')
    count = max(counts.values())
    if stretch is not None and not 0 <= stretch < count:
        raise TimeError(f'stretch = {stretch} is outside of [0, {count - 1}]')
    if count == 1:
        return [items[0] for items in parts.values()]
    sizes = [min(items[k].size for items in parts.values()) for k in range(count)]
    if stretch is None:
        stretch = int(np.argmax(sizes))
        warnings.append(f'the driver was restarted while recording: stretches of {sizes} samples; '
                        f'number {stretch} is read')
    return [items[stretch] for items in parts.values()]
