"""
Plays blocks of set-points, and never one that is too old.

Pure logic: instants are integers in ns of the same clock as the samples' stamps, handed in.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from threading import Lock

import numpy as np

from .limits import Limits, Mode, Setpoint
from .setpoint_blocks import SECOND, SetpointBlock

GAP = SECOND
"""
ns that a block may start after the last set-point that waits. By a sender's clock that is ahead of
the driver's, the motor would move long after anybody commands it.
"""
RESTS = 0.01
"""Share of its limit within which a last voltage, current or speed leaves the rig at rest."""


@dataclass(frozen=True)
class Receipt:
    """What became of a block: how many set-points it had, were already too old, were clamped."""

    received: int
    too_old: int
    clamped: int
    note: str


class Refused(ValueError):
    """A block of set-points that cannot be played as a whole; the queue stays as it was."""


class SetpointPlayer:
    """
    Holds the set-points to come and tells which one is due.

    A block rules from its first instant on: what was queued from there on is dropped. A set-point
    holds until the next one, but never longer than ``timeout`` seconds after its own instant. The
    player is filled by one thread and played by another.

    ``limits`` may change at any time: what waits is held to those of its turn, and ``limited``
    counts how often that was so.

    ``expired`` counts streams that ended while the rig was to move, ``ended`` those that ended at
    rest: by mode OFF, by a reference within RESTS of its limit, or by a position that was held.
    """

    def __init__(self, timeout: float, limits: Limits, capacity: int = 200_000,
                 horizon: float = 60.0) -> None:
        self.timeout = timeout
        self.limits = limits
        self.capacity = capacity
        self.horizon = horizon
        self.expired = self.ended = self.limited = 0
        self._queue: deque[SetpointBlock] = deque()
        self._waiting = 0
        self._now_playing: Setpoint | None = None
        self._before: Setpoint | None = None
        self._lock = Lock()

    def add(self, start: int, mode: int, period: float, reference: Sequence[float],
            external_torque: Sequence[float], now: int) -> Receipt:
        """
        Queue a block whose first set-point takes effect at ``start`` ns, the next ``period`` s on.

        References outside the limits are clamped and counted. Raises Refused when the mode is
        unknown, lengths differ, a value is not finite, the period of a block is not positive or
        longer than ``horizon`` s. So it does when the block lies more than ``horizon`` s ahead, or
        more than GAP behind all that waits, or does not fit the queue.

        OFF is never refused and never too old: of its block the stamp alone counts, and where
        that cannot be followed the motor is off at once.
        """
        mode = self._judge(start, mode, period, reference, external_torque, now)
        oldest = now - int(self.timeout * SECOND)
        if mode is Mode.OFF:
            reference, external_torque = [0.0], []
            if start < oldest or self._too_far(start, now):
                start = now
        block = SetpointBlock(start, mode, period, reference, external_torque, oldest,
                              self.limits)
        if len(block):
            with self._lock:
                self._put(block, start)
        return Receipt(len(reference), block.too_old, block.clamped, block.note)

    def _put(self, block: SetpointBlock, start: int) -> None:
        """Queue a block in the place of all that waits from ``start`` on, or raise Refused."""
        queue = self._queue
        replaced = 0
        for one in reversed(queue):
            if one.last < start:
                break
            replaced += len(one) - one.before(start)
        kept = self._waiting - replaced
        if kept + len(block) > self.capacity:
            raise Refused(f'{len(block)} set-points do not fit beside the {kept} that wait; '
                          f'at most {self.capacity} may wait')
        while queue and queue[-1].last >= start:
            left = queue[-1].before(start)
            if left:
                queue[-1].keep(left)
            else:
                queue.pop()
        queue.append(block)
        self._waiting = kept + len(block)

    def _judge(self, start: int, mode: int, period: float, reference: Sequence[float],
               external_torque: Sequence[float], now: int) -> Mode:
        try:
            mode = Mode(mode)
        except ValueError:
            raise Refused(f'mode {mode} is unknown; it is one of '
                          f'{[f"{m.name} = {m.value}" for m in Mode]}') from None
        if mode is Mode.OFF:
            return mode
        if not len(reference):
            raise Refused('the block holds no reference; it needs at least one')
        if len(reference) > self.capacity:  # before each is looked at: the drive waits meanwhile
            raise Refused(f'the block holds {len(reference)} set-points; at most {self.capacity} '
                          'may wait')
        if len(external_torque) not in (0, len(reference)):
            raise Refused(f'external_torque has {len(external_torque)} values beside '
                          f'{len(reference)} references; give as many, or none')
        for name, values in (('reference', reference), ('external_torque', external_torque)):
            finite = np.isfinite(np.asarray(values, float))
            if not finite.all():
                k = int(finite.argmin())
                raise Refused(f'{name}[{k}] = {values[k]}; every value must be finite')
        if len(reference) > 1 and not 0.0 < period <= self.horizon:
            raise Refused(f'period = {period} s; a block of {len(reference)} set-points needs one '
                          f'above 0, of at most {self.horizon:g} s')
        if allowed := self._too_far(start, now):
            raise Refused(f'the block starts {(start - now) / SECOND:.1f} s ahead, {allowed}; '
                          "do sender and driver share the driver's ROS clock?")
        return mode

    def _too_far(self, start: int, now: int) -> str:
        """
        Return what is allowed where a block starts later than that; '' where it does not.

        The motor must not begin to move long after it was told to, when nobody expects that.
        """
        if start - now > self.horizon * SECOND:
            return f'at most {self.horizon:g} s are allowed'
        with self._lock:
            last = max(now, self._queue[-1].last) if self._queue else now
        return (f'and at most {GAP / SECOND:g} s are allowed without a set-point before it'
                if start - last > GAP else '')

    def at(self, instant: int, now: int) -> Setpoint | None:
        """
        Return the set-point to hold from ``instant`` on, or None when none is young enough.

        ``now`` is the time at which it goes out (it may lag behind ``instant``): the age is
        counted from the set-point's own instant to the later of the two.
        """
        with self._lock:
            queue, playing = self._queue, self._now_playing
            while queue and queue[0].next <= instant:
                waited = len(queue[0])
                before, point = queue[0].play(instant)
                self._before, playing = before or playing, point
                self._waiting -= waited - len(queue[0])
                if not queue[0]:
                    queue.popleft()
            self._now_playing = playing
        if playing is None:
            return None
        given, playing = playing, self.limits.held(playing)
        self.limited += playing is not given
        if max(instant, now) > self.expires(playing):
            self._now_playing = None
            if self._rests(playing):
                self.ended += 1
            else:
                self.expired += 1
            return None
        return playing

    def expires(self, point: Setpoint) -> int:
        """Return until when a set-point may be held, ns."""
        return point.instant + int(self.timeout * SECOND)

    def _rests(self, point: Setpoint) -> bool:
        if point.mode is Mode.OFF:
            return True
        low, high = self.limits.range(point.mode)
        if point.mode is not Mode.POSITION:
            return abs(point.reference) <= RESTS * high
        before = self._before
        return before is not None and before.mode is point.mode and (
            abs(point.reference - before.reference) <= 1e-6 * (high - low))

    def clear(self) -> None:
        """Drop everything, as when the rig went away: it shall not start by an old block."""
        with self._lock:
            self._queue.clear()
            self._waiting = 0
            self._now_playing = None

    @property
    def playing(self) -> bool:
        """Whether a set-point was handed out last."""
        return self._now_playing is not None

    @property
    def waiting(self) -> int:
        """Number of set-points that are yet to come."""
        return self._waiting
