"""
Where a shaft stands whose drive tells its angle within a range alone, and commands it there.

Behind the end of its range an angle goes on at the other end, or is held. The drive itself may
count on, so that a position sent in its range may lie whole ranges away from the shaft.
"""

from __future__ import annotations

from math import isfinite, nan

from .bit_frames import Range

SAME = 1.0
"""rad by which the counted angle and the one within the range may differ; a shaft moves on."""
UNANSWERED = 1000
"""Angles that may come before the drive has told its count; answers may be behind by seconds."""


class CountedTurns:
    """
    Counts the turns of one shaft, from those that the drive itself has counted.

    ``ends`` is the range of its angle, rad, ``wraps`` whether it goes on at the other end. Each
    sample moves it by less than half the range, or the count is lost. ``known`` says that it is
    that of the drive as far as anybody has seen, ``asking`` that the drive has still to tell it.
    """

    def __init__(self, ends: Range, wraps: bool) -> None:
        self._ends, self._wraps = ends, wraps
        self._span = ends.high - ends.low
        self.begin(False)

    def begin(self, asking: bool) -> None:
        """Count from nothing; ``asking``: until the drive has told its own count."""
        self.known, self.asking = not self._wraps, asking
        self._unanswered = 0
        self._turns = 0.0
        self._last: float | None = None
        self._whole: float | None = None

    def ask(self, lost: bool) -> None:
        """Have a drive asked once more that has told its count; ``lost``: turns may be missing."""
        if self.known and self._wraps:
            self.known, self.asking, self._unanswered = not lost, True, 0

    def give_up(self) -> None:
        """Take the drive for one that does not tell its count, if it has not yet."""
        self.known, self.asking = self.known and not self.asking, False

    def whole(self, angle: float) -> None:
        """Take the drive's counted angle, rad; it goes with the next angle of the range."""
        self._whole = angle

    def angle(self, told: float) -> float:
        """Return the counted angle, rad, for one of the range; NaN for one that is held."""
        last, self._last = self._last, told
        if not self._wraps:
            return told if self._within(told) else nan
        if last is not None and abs(told - last) > 0.5 * self._span:
            self._turns += self._span if told < last else -self._span
        whole, self._whole = self._whole, None
        if whole is not None and isfinite(whole):
            turns = self._span * round((whole - told) / self._span)
            if abs(whole - told - turns) < SAME:
                self._turns, self.known, self.asking = turns, True, False
        if self.asking:
            self._unanswered += 1
            if self._unanswered > UNANSWERED:
                self.give_up()
        return told + self._turns

    def _within(self, told: float) -> bool:
        return self._ends.low < told < self._ends.high

    @property
    def commandable(self) -> bool:
        """Whether a position of the range is what the drive takes it for."""
        return (self.known and not self.asking and not self._turns
                and self._last is not None and (self._wraps or self._within(self._last)))

    def no_position(self, joint: str, table: str) -> str:
        """Return why no position is commanded and what to do; '' where one is, or soon may be."""
        if self.commandable or self.asking or self._last is None:
            return ''
        ends = f'[{self._ends.low:.4g}, {self._ends.high:.4g}] rad'
        to_do = ('Turn it back into the range by a velocity or a current, or set its zero with '
                 'the tool of the drive and activate the driver again')
        if not self._wraps:
            why = f'stands at or beyond an end of {ends}, the range in which the drive tells it'
        elif self.known:
            why = (f'stands at {self._last + self._turns:.4g} rad, beyond {ends}, the range of '
                   'positions of the drive')
        else:
            why = (f'is told within {ends} alone, and the drive has not told how often it went '
                   'round')
            to_do = ('Activate the driver again; where that does not help, device.table = '
                     f"{table} needs frames 'turns' and 'turns_told' that the drive answers")
        return (f"joint '{joint}' {why}, so that the drive might turn by whole ranges. {to_do}. "
                'Velocity and current are taken as before')
