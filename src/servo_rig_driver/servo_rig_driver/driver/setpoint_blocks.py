"""
Blocks of set-points that wait to be played.

A block may hold as many as may wait at all, and the rig is sampled while it is taken in. So all of
it is judged by arrays, and a set-point is made of it when its turn comes.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from .limits import Limits, Mode, Setpoint, UNITS

SECOND = 1_000_000_000


class SetpointBlock:
    """
    Set-points of one mode: instants in ns, references, external torques or None, within limits.

    ``too_old`` were left out since they lie before ``oldest``, and ``clamped`` were beyond the
    limits, the first as ``note`` says. It holds those that are yet to be played, from the one of
    the instant ``next`` on.
    """

    __slots__ = ('_at', '_end', '_instants', '_references', '_torques', 'clamped', 'mode', 'next',
                 'note', 'too_old')

    def __init__(self, start: int, mode: Mode, period: float, reference: Sequence[float],
                 external_torque: Sequence[float], oldest: int, limits: Limits) -> None:
        self.mode = mode
        instants = _instants(start, period, len(reference))
        self.too_old = begin = int(np.searchsorted(instants, oldest)) if start < oldest else 0
        self._instants = memoryview(instants[begin:])
        given = np.asarray(reference, float)[begin:]
        self._references, beyond = _held(given, *limits.range(mode))
        self.clamped, self.note, first = beyond.size, '', len(given)
        if beyond.size:
            first = beyond[0]
            self.note = (f'clamped {mode.name.lower()} {given[first]:g} to '
                         f'{self._references[first]:g} {UNITS[mode]}')
        self._torques = None
        if len(external_torque):
            given, top = np.asarray(external_torque, float)[begin:], limits.external_torque
            self._torques, beyond = _held(given, -top, top)
            self.clamped += beyond.size
            if beyond.size and beyond[0] < first:
                self.note = (f'clamped external torque {given[beyond[0]]:g} N m to {top:g} N m '
                             'in size')
        self._at, self._end = 0, len(given)
        self._look()

    def _look(self) -> None:
        self.next = self._instants[self._at] if self._at < self._end else None

    def __len__(self) -> int:
        """Return how many are yet to be played."""
        return self._end - self._at

    @property
    def last(self) -> int:
        """The instant of the last set-point, ns."""
        return self._instants[self._end - 1]

    def before(self, instant: int) -> int:
        """Return how many of those that are yet to be played lie before an instant, ns."""
        return bisect_right(self._instants, instant - 1, self._at, self._end) - self._at

    def keep(self, count: int) -> None:
        """Leave out all but the next ``count``."""
        self._end = self._at + count
        self._look()

    def play(self, instant: int) -> tuple[Setpoint | None, Setpoint]:
        """Pass on to the last set-point up to an instant; return the one before it, and it."""
        count = self.before(instant + 1)
        self._at += count
        self._look()
        return self._point(self._at - 2) if count > 1 else None, self._point(self._at - 1)

    def _point(self, k: int) -> Setpoint:
        torque = None if self._torques is None else self._torques.item(k)
        return Setpoint(self._instants[k], self.mode, self._references.item(k), torque)


def _held(given: np.ndarray, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Return values held within limits, and the places of those that were beyond."""
    held = np.minimum(np.maximum(given, low), high)
    return held, (held != given).nonzero()[0]


def _instants(start: int, period: float, count: int) -> np.ndarray:
    """Return the instants of set-points, ns; the period of a single one means nothing."""
    if count < 2:
        return np.array([start] * count, np.int64)
    return start + np.rint(np.arange(count) * (period * SECOND)).astype(np.int64)
