"""The last minute of a rig and its twin at full rate, and what of it an eye can see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from threading import Lock

import numpy as np

from ..physics.servo import Servo
from ..recording.joined_samples import CHANNELS
from ..recording.recording import BALANCES, COLUMNS, COMPARED, PREDICTED

SECONDS = 64.0
"""How much is kept, s."""

NAMES = (*CHANNELS, *(f'twin.{name}' for name in PREDICTED),
         *(f'gap.{name}' for name in COMPARED), *(f'balance.{name}' for name in BALANCES))
"""What is kept of a sample: the rig's channels, the twin's, rig minus twin, the balances."""

LARGEST = 1e30
"""What is beyond is held here, as of a twin that ran away: a page takes no infinite numbers."""
_PLACES = {name: place for place, name in enumerate(NAMES)}
_LATE = 0.5  # s behind the newest sample from which a part is not waited for


class Traces:
    """
    A ring of samples by their running numbers; written by one thread, read by another.

    ``generation`` counts how often it began again: another period, or numbers that went back.
    ``stamp`` is the instant of sample number 0 in ns, ``period`` is in s and 0 before any sample.
    """

    def __init__(self, seconds: float = SECONDS) -> None:
        self.seconds = seconds
        self.generation = 0
        self.period = 0.0
        self.stamp = 0
        self.end = 0
        self._begin = 0
        self._parts: dict[str, int] = {}
        self._lock = Lock()
        self._rows = np.empty((len(NAMES), 0), np.float64)

    @property
    def size(self) -> int:
        """How many samples are here, those included that are not known."""
        return self.end - self._begin

    def clear(self) -> None:
        """Forget everything."""
        with self._lock:
            self._restart(0, 0, 0.0)

    def put(self, part: str, sequence: int, stamp: int, period: float,
            columns: Mapping[str, np.ndarray]) -> None:
        """
        Take a block of one part (a topic), columns by name, each of shape (n,).

        ``stamp`` is the instant of its first sample in ns. What lies before the oldest sample, or
        more than a second after the newest one, is of another run and left out; numbers of
        `encoder` that go back, or that jump, begin again.
        """
        count = min((len(one) for one in columns.values() if len(one)), default=0)
        if not count or not period > 0.0:
            return
        with self._lock:
            first = part == 'encoder'
            ahead = sequence - self.end
            if first and (abs(period - self.period) > 1e-9 * period
                          or sequence < self._parts.get(part, 0)
                          or ahead * period > self.seconds):
                self._restart(sequence, stamp - round(sequence * period * 1e9), period)
            if not self.period or sequence < self._begin or not first and ahead * period > 1.0:
                return
            if first:
                self.stamp = stamp - round(sequence * period * 1e9)
            self._grow(sequence + count)
            self._parts[part] = sequence + count
            places = np.arange(sequence, sequence + count) % self._rows.shape[1]
            for name, values in columns.items():
                if name in _PLACES and len(values) == count:
                    self._rows[_PLACES[name], places] = np.clip(values, -LARGEST, LARGEST)

    def _restart(self, sequence: int, stamp: int, period: float) -> None:
        self.generation += 1
        size = round(self.seconds / period) if period else 0
        if self._rows.shape[1] != size:
            self._rows = np.empty((len(NAMES), size), np.float64)
        self.period, self.stamp, self.end, self._begin = period, stamp, sequence, sequence
        self._parts = {}

    def _grow(self, end: int) -> None:
        """Make room up to a running number; what is not known yet is NaN."""
        room = self._rows.shape[1]
        if end > self.end:
            new = np.arange(max(self.end, end - room), end) % room
            self._rows[:, new] = nan
            self.end = end
            self._begin = max(self._begin, end - room)

    def settled(self) -> int:
        """Return the running number up to which all parts that keep up have come."""
        with self._lock:
            late = _LATE / self.period if self.period else 0.0
            return min((end for end in self._parts.values() if self.end - end <= late),
                       default=self.end)

    def read(self, names: Sequence[str], first: int, end: int) -> np.ndarray:
        """Return samples ``first`` to ``end``, shape (names, end - first); NaN where unknown."""
        with self._lock:
            out = np.full((len(names), max(0, end - first)), nan)
            low, high = max(first, self._begin), min(end, self.end)
            if low < high:
                room = self._rows.shape[1]
                rows = [_PLACES[name] for name in names]
                for start, stop in _pieces(low, high, room):
                    at = start % room
                    out[:, start - first:stop - first] = self._rows[rows, at:at + stop - start]
            return out

    def extremes(self, names: Sequence[str], bucket: int, first: int, count: int) -> np.ndarray:
        """
        Return the smallest and largest value of each of ``count`` buckets of samples.

        Bucket k holds the samples numbered from ``k * bucket`` on. The shape is
        (names, 2, count), float32; a bucket without a known sample is NaN.
        """
        rows = self.read(names, first * bucket, (first + count) * bucket)
        rows = rows.reshape(len(names), count, bucket)
        return np.stack([np.fmin.reduce(rows, axis=2), np.fmax.reduce(rows, axis=2)],
                        axis=1).astype(np.float32)

    def levels(self, seconds: float = 1.0) -> dict[str, float]:
        """Return the RMS of each balance over the last seconds, in noise floors, where known."""
        if not self.period:
            return {}
        end = self.settled()
        rows = self.read([f'balance.{name}' for name in BALANCES],
                         end - round(seconds / self.period), end)
        good = np.isfinite(rows)
        square = np.where(good, rows, 0.0) ** 2
        return {name: float(np.sqrt(square[k].sum() / good[k].sum()))
                for k, name in enumerate(BALANCES) if good[k].any()}


def units(servo: Servo | None) -> dict[str, str]:
    """Return the unit of each name as a servo has it; a balance is in noise floors."""
    of = {name: servo.reads(unit, name) if servo else unit for name, unit in COLUMNS.items()}
    return {**of, **{f'twin.{name}': of[name] for name in PREDICTED},
            **{f'gap.{name}': of[name] for name in COMPARED},
            **{f'balance.{name}': '× noise' for name in BALANCES}}


def _pieces(low: int, high: int, room: int) -> list[tuple[int, int]]:
    """Cut a range of running numbers where the ring begins again."""
    turn = (low // room + 1) * room
    return [(low, high)] if high <= turn else [(low, turn), (turn, high)]
