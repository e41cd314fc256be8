"""The last minutes of a running rig."""

from __future__ import annotations

from threading import Lock

import numpy as np

from servo_twin.recording.joined_samples import CHANNELS
from servo_twin.recording.recording import Recording

RUNNING = 'running'
"""The excitation family of what was taken of a running rig."""

_BRIDGED = 0.1  # s of missing samples that a stretch may hold, as NaN; more of them end it
_SHORTEST = 3.0  # s of a stretch that is worth a recording of its own: a diagnosis takes no less


class Ring:
    """
    Keeps the last ``seconds`` of joined samples; written by one thread, read by others.

    A hole ends a stretch of samples and begins another; both are kept. Where the running number
    starts again, or jumps further than the ring reaches, all before is forgotten. The length is
    that of the last stretch.

    Raises ValueError where ``seconds`` is not positive.
    """

    def __init__(self, seconds: float) -> None:
        if not seconds > 0.0:
            raise ValueError(f'a buffer of {seconds:g} s holds nothing; it must be positive')
        self.seconds = seconds
        self.period = 0.0
        self._lock = Lock()
        self._rows = np.empty((0, len(CHANNELS)))
        self._clear()

    def _clear(self) -> None:
        self._size, self._at = 0, 0
        self._next, self._stamp = -1, 0
        self._stretches: list[list[int]] = []  # numbers, from and up to

    def __len__(self) -> int:
        return self._last if self._stretches else 0

    @property
    def _last(self) -> int:
        return min(self._size, self._next - self._stretches[-1][0])

    @property
    def next(self) -> int:
        """Running number that the next sample should have; -1 before the first."""
        return self._next

    def put(self, sequence: int, stamp: int, period: float, samples: np.ndarray) -> None:
        """Take a block (n, len(CHANNELS)); ``stamp``: ns of its first sample."""
        with self._lock:
            if abs(period - self.period) > 1e-9 * period:
                self._rows = np.empty((max(1, round(self.seconds / period)), len(CHANNELS)))
                self.period = period  # only now: without memory for the rows it begins again
                self._clear()
            missing = sequence - self._next if self._next >= 0 else 0
            if not 0 <= missing < len(self._rows):
                self._clear()
            elif missing:
                self._put(np.full((missing, len(CHANNELS)), np.nan))
            self._put(samples)
            self._next = sequence + len(samples)
            if not self._stretches or missing > round(_BRIDGED / period):
                self._stretches.append([sequence, self._next])
            self._stretches[-1][1] = self._next
            while self._stretches[0][1] <= self._next - self._size:
                del self._stretches[0]
            self._stamp = stamp + round(len(samples) * period * 1e9)

    def _put(self, samples: np.ndarray) -> None:
        room = len(self._rows)
        samples = samples[-room:]
        places = (self._at + np.arange(len(samples))) % room
        self._rows[places] = samples
        self._at = (self._at + len(samples)) % room
        self._size = min(room, self._size + len(samples))

    def since(self, sequence: int) -> float:
        """Return how many seconds of samples from a running number on are here."""
        with self._lock:
            return max(0, min(len(self), self._next - sequence)) * self.period

    def rows(self, first: int, count: int) -> np.ndarray:
        """Return ``count`` samples from number ``first`` on; NaN where there are none."""
        with self._lock:
            out = np.full((count, len(CHANNELS)), np.nan)
            oldest = self._next - self._size
            start, end = max(first, oldest), min(first + count, self._next)
            if start < end:
                places = (self._at - (self._next - np.arange(start, end))) % len(self._rows)
                out[start - first:end - first] = self._rows[places]
            return out

    def recording(self, seconds: float, name: str, servo: str, servo_text: str) -> Recording:
        """
        Return the last ``seconds`` of the last stretch, or what there is of them, as a recording.

        Raises ValueError when there is less than a second.
        """
        with self._lock:
            size = min(len(self), round(seconds / self.period)) if self.period else 0
            if size * self.period < 1.0:
                raise ValueError(f'the running rig has been heard for {size * self.period:.2g} s; '
                                 f'at least 1 s is needed, or name bags')
            return self._recording(self._next - size, self._next, name, servo, servo_text)

    def recordings(self, name: str, servo: str, servo_text: str) -> list[Recording]:
        """
        Return each stretch of three seconds and more as a recording, oldest first.

        Where there is none, the last one; raises ValueError when it lasts less than a second.
        """
        with self._lock:
            oldest = self._next - self._size
            whole = [(max(oldest, first), end) for first, end in self._stretches
                     if (end - max(oldest, first)) * self.period >= _SHORTEST]
            if whole:
                return [self._recording(*place, name if len(whole) == 1 else f'{name}_{k}', servo,
                                        servo_text) for k, place in enumerate(whole, 1)]
        return [self.recording(self.seconds, name, servo, servo_text)]

    def _recording(self, first: int, end: int, name: str, servo: str, servo_text: str
                   ) -> Recording:
        rows = self._rows[(self._at - (self._next - np.arange(first, end))) % len(self._rows)]
        return Recording(
            name=name, period=self.period,
            columns={c: rows[:, k].copy() for k, c in enumerate(CHANNELS)},
            start=(self._stamp - round((self._next - first) * self.period * 1e9)) * 1e-9,
            sequence=first, family=RUNNING, servo=servo, servo_file=servo_text,
            note='the last seconds of the running rig')
