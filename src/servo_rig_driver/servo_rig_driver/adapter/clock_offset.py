"""How far the clock that stamps a topic is off ours, from what it says and when it comes."""

from __future__ import annotations

SECOND = 1_000_000_000
SAME = SECOND // 10  # ns; stamps that are off by less are taken as of our own clock
WINDOW = SECOND  # ns of messages whose fastest one tells the offset
SLEW = 1e-4  # s a second at most by which an offset follows a clock that drifts
LEAP = SECOND  # ns; what was held up on its way has stamps that go on evenly
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
    Both must be off alike: a wrong stamp between two windows makes one short and the other long.
    ``strays`` counts stamps that no other one agreed with, ``taken`` all other messages, ``unset``
    those of them whose stamp is 0. ``least`` is the least of (receipt - stamp) in the last window,
    None before: below 0, the clock is before ours.
    """

    def __init__(self) -> None:
        self.offset = 0
        self.jumps = self.strays = self.taken = self.unset = 0
        self.least: int | None = None
        self._target: int | None = None
        self._least: int | None = None
        self._until = 0
        self._last = 0
        self._begun: tuple[int, int] | None = None
        self._paces = (1.0, 1.0)
        self._kept: tuple[int, int] | None = None
        self._aside: tuple[int, int] | None = None

    @property
    def pace(self) -> float:
        """Seconds of the clock in a second of ours."""
        slow, fast = max(self._paces) < 1.0 - PACE, min(self._paces) > 1.0 + PACE
        return self._paces[1] if slow or fast else 1.0

    def stray(self, stamp: int, received: int) -> bool:
        """
        Tell whether a stamp is to be left out: it leapt, and the next one must agree first.

        A clock that is set leaps once; a single wrong stamp leaps there and back.
        """
        if not stamp:
            return False
        if _leapt(self._kept, stamp, received) and (
                self._aside is None or _leapt(self._aside, stamp, received)):
            self._aside = stamp, received
            self.strays += 1
            return True
        if self._aside is not None and self._was_set(stamp, received):
            self._least, self._until = None, received  # the window ends here, and the offset moves
        self._kept, self._aside = (stamp, received), None
        return False

    def _was_set(self, stamp: int, received: int) -> bool:
        """
        Tell whether a leap that two stamps agree on is of the clock.

        No transit makes stamps go back, nor a message come before it was made.
        """
        return _leapt(self._kept, stamp, received) and (
            stamp < self._kept[0] or received - stamp < self.offset - SAME)

    def local(self, stamp: int, received: int) -> int:
        """Return the instant of a message by our clock; a stamp of 0 is none: the receipt."""
        self.taken += 1
        if not stamp:
            self.unset += 1
            return received
        seen = received - stamp
        self._begun = self._begun or (stamp, received)
        if self._least is None or seen < self._least:
            self._least = seen
        if self._target is None:  # the first window may only become less
            self.offset = self._wanted(self._least)
            self._until = self._until or received + WINDOW
        if received >= self._until:
            self._target, self.least = self._wanted(self._least), self._least
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


def _leapt(before: tuple[int, int] | None, stamp: int, received: int) -> bool:
    """Tell whether a stamp went on by another time than receipts did, by more than LEAP."""
    if before is None:
        return False
    step = stamp - before[0]
    return abs(step) > LEAP and abs(step - (received - before[1])) > LEAP
