"""ROS time that never steps: asked for once, and counted on by the steady clock of the machine."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic_ns

READINGS = 10


class SteadyClock:
    """
    Tells the time of ``clock``, ns, as it was at the start and as the steady clock went on.

    The best of some readings counts: the machine may stand still between the two clocks, and every
    age would be wrong by as much for as long as the driver runs.
    """

    def __init__(self, clock: Callable[[], int], steady: Callable[[], int] = monotonic_ns) -> None:
        self._steady = steady
        readings = []
        for _ in range(READINGS):
            before, told, after = steady(), clock(), steady()
            readings.append((after - before, told - (before + after) // 2))
        self._offset = min(readings)[1]

    def now(self) -> int:
        """Return the time, ns."""
        return self._steady() + self._offset

    def steady(self, instant: int) -> int:
        """Return what the steady clock (CLOCK_MONOTONIC) tells at an instant, ns."""
        return instant - self._offset
