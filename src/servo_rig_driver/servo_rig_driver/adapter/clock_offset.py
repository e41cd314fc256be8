"""How far the clock that stamps a topic is off ours, from what it says and when it comes."""

from __future__ import annotations

SECOND = 1_000_000_000
SAME = SECOND // 10  # ns; stamps that are off by less are taken as of our own clock
WINDOW = SECOND  # ns of messages whose fastest one tells the offset
SLEW = 1e-4  # s a second at most by which an offset follows a clock that drifts
PACE = 0.05  # by which a clock may go faster or slower than ours over a window: transits differ


class ClockOffset:
    """
    Brings the stamps of one topic to our clock; all times are in ns.

    The fastest message of a window has the least transit, so the least of (receipt - stamp) is the
    offset of the clock, transit included. Below SAME the clocks count as one and stamps stay as
    they are. Otherwise the offset follows at no more than SLEW, so that time stays even.
    ``jumps`` counts the times that it moved by more than SAME at once: a clock was set. ``pace``
    is how fast the clock goes, 1 where it was within PACE of ours in one of the last two windows:
    a simulation has a pace of its own, and the clock of stamps that never change stands still.
    """

    def __init__(self) -> None:
        self.offset = 0
        self.jumps = 0
        self._target: int | None = None
        self._least: int | None = None
        self._until = 0
        self._last = 0
        self._begun: tuple[int, int] | None = None
        self._paces = (1.0, 1.0)

    @property
    def pace(self) -> float:
        """Seconds of the clock in a second of ours."""
        return self._paces[1] if all(abs(one - 1.0) > PACE for one in self._paces) else 1.0

    def local(self, stamp: int, received: int) -> int:
        """Return the instant of a message by our clock; a stamp of 0 is none: the receipt."""
        if not stamp:
            return received
        seen = received - stamp
        self._begun = self._begun or (stamp, received)
        if self._least is None or seen < self._least:
            self._least = seen
        if self._target is None:  # the first window may only become less
            self.offset = self._wanted(self._least)
            self._until = self._until or received + WINDOW
        if received >= self._until:
            self._target = self._wanted(self._least)
            self._least, self._until = None, received + WINDOW
            self._measure(stamp, received)
            if abs(self._target - self.offset) > SAME:
                self.offset = self._target
                self.jumps += 1
        elif self._target is not None:
            most = round(SLEW * max(0, received - self._last))
            self.offset += max(-most, min(most, self._target - self.offset))
        self._last = received
        return stamp + self.offset

    def _measure(self, stamp: int, received: int) -> None:
        pace = (stamp - self._begun[0]) / max(1, received - self._begun[1])
        self._paces = self._paces[1], pace
        self._begun = stamp, received

    @staticmethod
    def _wanted(seen: int) -> int:
        return 0 if abs(seen) < SAME else seen
