"""ROS time that never steps: asked for once, and counted on by the steady clock of the machine."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic_ns

READINGS = 10
CLOSE = 20_000  # ns between two looks at the steady clock that leave nothing to better


class SteadyClock:
    """
    Tells the time of ``clock``, ns, as it was at the start and as the steady clock went on.

    The best of some readings counts: the machine may stand still between the two clocks, and every
    age would be wrong by as much for as long as the driver runs.
    """

    def __init__(self, clock: Callable[[], int], steady: Callable[[], int] = monotonic_ns) -> None:
        self._clock, self._steady = clock, steady
        self._offset = self._read()

    def now(self) -> int:
        """Return the time, ns."""
        return self._steady() + self._offset

    def stepped(self) -> int:
        """
        Return how far ``clock`` has been set forward since the start, ns; negative: back.

        A machine that slept counts as set forward: the steady clock slept with it.
        """
        return self._read() - self._offset

    def steady(self, instant: int) -> int:
        """Return what the steady clock (CLOCK_MONOTONIC) tells at an instant, ns."""
        return instant - self._offset

    def _read(self) -> int:
        """Return how far ``clock`` is ahead of the steady clock, ns."""
        readings = []
        for _ in range(READINGS):
            before, told, after = self._steady(), self._clock(), self._steady()
            readings.append((after - before, told - (before + after) // 2))
            if after - before < CLOSE:
                break
        return min(readings)[1]
