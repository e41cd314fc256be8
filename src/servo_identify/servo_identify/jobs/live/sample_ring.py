"""The last minutes of a running rig."""

from __future__ import annotations

from threading import Lock

import numpy as np

from servo_twin.recording.joined_samples import CHANNELS
from servo_twin.recording.recording import Recording

RUNNING = 'running'
"""The excitation family of what was taken of a running rig."""

_BRIDGED = 0.1  # s of missing samples that are kept as NaN; after more of them it begins again


class Ring:
    """
    Keeps the last ``seconds`` of joined samples; written by one thread, read by others.

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

    def __len__(self) -> int:
        return self._size

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
            if not 0 <= missing <= round(_BRIDGED / period):
                self._clear()
            elif missing:
                self._put(np.full((missing, len(CHANNELS)), np.nan))
            self._put(samples)
            self._next = sequence + len(samples)
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
            return max(0, min(self._size, self._next - sequence)) * self.period

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
        Return the last ``seconds``, or what there is of them, as a recording.

        Raises ValueError when there is less than a second.
        """
        with self._lock:
            size = min(self._size, round(seconds / self.period)) if self.period else 0
            if size * self.period < 1.0:
                raise ValueError(f'the running rig has been heard for {size * self.period:.2g} s; '
                                 f'at least 1 s is needed, or name bags')
            places = (self._at - size + np.arange(size)) % len(self._rows)
            rows = self._rows[places]
            return Recording(
                name=name, period=self.period,
                columns={c: rows[:, k].copy() for k, c in enumerate(CHANNELS)},
                start=(self._stamp - round(size * self.period * 1e9)) * 1e-9,
                sequence=self._next - size, family=RUNNING, servo=servo, servo_file=servo_text,
                note='the last seconds of the running rig')
