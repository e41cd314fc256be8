"""The clock of one run: what the wall clock told as the run began, and the steady clock since."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic_ns

READINGS = 5  # of both clocks, of which the closest counts: a pause between the two adds to it


class RunClock:
    """Goes by ``wall``, ns, as it was at first; a wall clock that is set later changes nothing."""

    def __init__(self, wall: Callable[[], int]) -> None:
        self._wall = wall
        self._ahead = self._wall_ahead()

    def now(self) -> int:
        """Return the time, ns."""
        return monotonic_ns() + self._ahead

    def stepped(self) -> float:
        """Return how far the wall clock was set forward since the run began, s; negative: back."""
        return (self._wall_ahead() - self._ahead) * 1e-9

    def _wall_ahead(self) -> int:
        return min(-monotonic_ns() + self._wall() for _ in range(READINGS))
