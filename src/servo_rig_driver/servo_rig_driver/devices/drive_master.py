"""
Leads a drive up and down, one order at a time, whatever protocol it speaks.

The states are those of CiA 402, the finest that drives here have; a protocol that knows fewer
states uses those that it has. Pure logic: no bus, no clock; time is handed in, in seconds.
"""

from __future__ import annotations

from enum import Enum
from math import inf


class DriveState(Enum):
    """How a drive stands, in the words of CiA 402; UNKNOWN until it has told."""

    NOT_READY = 'not ready'
    SWITCH_ON_DISABLED = 'switch on disabled'
    READY_TO_SWITCH_ON = 'ready to switch on'
    SWITCHED_ON = 'switched on'
    OPERATION_ENABLED = 'operation enabled'
    QUICK_STOP_ACTIVE = 'quick stop active'
    FAULT_REACTION_ACTIVE = 'fault reaction active'
    FAULT = 'fault'
    UNKNOWN = 'unknown'

    @property
    def words(self) -> str:
        """The name as people write it."""
        return self.value


FOLLOWS = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
"""States in which a motor has torque, and does what it is told."""
MAY_PUSH = (*FOLLOWS, DriveState.FAULT_REACTION_ACTIVE, DriveState.UNKNOWN)
"""States in which a motor has, or may have, torque."""


class Order(Enum):
    """What a master wants of a drive."""

    NO_TORQUE = 'no torque'
    QUICK_STOP = 'brake to rest'
    ENABLE = 'one step towards following the reference'
    RESET = 'clear the fault'


_LEADS_UP = (DriveState.SWITCH_ON_DISABLED, DriveState.READY_TO_SWITCH_ON, DriveState.SWITCHED_ON,
             DriveState.OPERATION_ENABLED)

_RUNGS = {state: rung for rung, state in enumerate((DriveState.NOT_READY, *_LEADS_UP))} | {
    DriveState.QUICK_STOP_ACTIVE: 0}
"""How far up a drive is; one in fault is on no rung."""
STOPPED_BY_OTHER = 'was told to give no torque, by another than this driver,'
STOPPED_BESIDE = ('went down without a fault or an order on the bus: it was stopped at its panel '
                  'or by a cable of its own,')
WENT_DOWN = STOPPED_BESIDE[:-1] + ', or it started again without saying so,'
PATIENCE = 16
FAULT_WENT = 'left its fault without a reset, as where its supply was cut,'
SETTLED = 0.5
"""After which a drive has obeyed an order that took its torque away, s."""


class DriveMaster:
    """
    Leads a drive to OPERATION ENABLED, or away from it.

    A fault is reset by an order that stands for ``pulse`` seconds; before each
    try the master waits ``pause`` seconds, and after ``resets`` tries it has ``given_up``. Tries
    are forgiven once the drive has been enabled for ``forgive`` seconds on end.

    A fault by which a drive tells that it missed frames of this driver is no fault of the drive.
    Its resets are counted in ``missed``, and it is reset for as long as it comes: after
    ``resets`` of them the pause doubles with each, up to PATIENCE times.

    A drive that somebody has stopped since begin(), while it followed or before it did, is
    ``held``. A stop that was there at begin() is reset like any fault. A drive that is held or
    given up stays down until begin(), whoever clears its fault.

    So is one that goes down by itself, without a fault and without an order of this master, one
    that another master took down, and one that was lost: ``why_held`` says so in words. One that
    was asked so late that its watchdog may have run out is led up again.

    A drive may have lost its supply where it goes down after a silence, or where its fault goes
    before this master has reset it. With ``after_loss`` it is led up again.

    A drive that follows its reference is taken down in order: quick stop, by which it brakes under
    its own ramp, and no torque once it says that it has stopped, at the latest ``quick_stop``
    seconds after.
    """

    def __init__(self, resets: int = 5, pause: float = 0.5, pulse: float = 0.05,
                 forgive: float = 10.0, quick_stop: float = 0.5, after_loss: bool = False) -> None:
        self.resets = resets
        self.pause = pause
        self.pulse = pulse
        self.forgive = forgive
        self.quick_stop = quick_stop
        self.after_loss = after_loss
        self.went_down = STOPPED_BESIDE  # what is said where it goes down by itself
        self.enable = False
        self.state = DriveState.UNKNOWN
        self.tries = self.missed = 0
        self._enabled_since: float | None = None
        self._stopping_since: float | None = None
        self._free = False  # whether it has told since begin() that nobody has stopped it
        self._led = False  # whether it was led up since begin()
        self.held = self.given_up = False
        self.why_held = ''
        self._rung: int | None = None  # up to which it was led; None: not known to obey yet
        self._told, self._lowered_at = -1, -inf
        self._failed = False  # whether it is in a fault that was not reset
        self._no_fault()

    def begin(self) -> None:
        """Note that a person wants the drive up: all tries are there again."""
        self.tries = self.missed = 0
        self._free = self._led = self._failed = self.held = self.given_up = False
        self.why_held = ''

    def hold(self, why: str) -> None:
        """Keep the drive down until begin(), and say why."""
        self.held, self.why_held = True, why

    def lost(self, why: str) -> None:
        """Keep a drive down that was led up since begin(), and may have lost its supply since."""
        if self._led and not self.after_loss:
            self.hold(why)

    @property
    def enabled(self) -> bool:
        """Whether the drive follows its reference, as far as it has told."""
        return self.enable and self.state is DriveState.OPERATION_ENABLED

    def forget(self) -> None:
        """Start over, as after a restart of the rig; the tries used up stay used up."""
        self.state = DriveState.UNKNOWN
        self._enabled_since = None
        self._rung, self._told = None, -1
        self._failed = False
        self._no_fault()

    def step(self, state: DriveState, now: float, emergency_stop: bool = False,
             starved: bool = False, missed: bool = False, loss: str = '') -> Order:
        """
        Return the order that answers a state of the drive.

        ``now`` is any steady time, s; ``starved``: its watchdog may have run out unsaid;
        ``missed``: its fault is that it missed frames of this driver; ``loss``: by what it may
        have lost its supply if it is down, in words. With ``enable`` false the
        drive is led by a quick stop to a state without torque, and a fault is left as it is.
        """
        order = self._order(state, now, emergency_stop, starved, missed, loss)
        if order is not Order.ENABLE:
            self._rung, self._told, self._lowered_at = None, -1, now
        return order

    def _order(self, state: DriveState, now: float, emergency_stop: bool, starved: bool,
               missed: bool, loss: str) -> Order:
        self.state = state
        if emergency_stop:
            self.held |= self._free
        elif state is not DriveState.UNKNOWN:
            self._free = True
        if self.state is not DriveState.OPERATION_ENABLED:
            self._enabled_since = None
        elif self._enabled_since is None:
            self._enabled_since = now
        elif now - self._enabled_since >= self.forgive:
            self.tries = self.missed = 0
        if not self.enable:
            return self._down(now)
        self._stopping_since = None
        if self.held or self.given_up:
            return Order.NO_TORQUE
        if self.state is DriveState.FAULT:
            return self._reset(now, missed)
        self._no_fault()
        self._judge(self._went_down(state, now), starved, loss)
        if state not in _LEADS_UP or self.held:
            return Order.NO_TORQUE
        self._led = True
        return Order.ENABLE

    def _judge(self, went_down: bool, starved: bool, loss: str) -> None:
        """Hold a drive that somebody has stopped, or that may have started again."""
        failed = self.state is DriveState.FAULT_REACTION_ACTIVE
        if self._failed and not failed:
            self.lost(FAULT_WENT)
        self._failed = failed
        if loss and (went_down or self.state is DriveState.UNKNOWN):
            self.lost(loss)
        elif went_down and not starved:
            self.hold(self.went_down)

    def _went_down(self, state: DriveState, now: float) -> bool:
        """
        Return whether a drive that was led up has gone down, by no order of this master.

        It obeys once it has gone up; before, it may still answer to an order to go down.
        """
        rung = _RUNGS.get(state, -1)
        told, self._told = self._told, rung
        if rung < 0:
            return False
        if self._rung is not None:
            down = rung < self._rung
            self._rung = None if down else rung
            return down
        if 0 <= told < rung or now - self._lowered_at > SETTLED:
            self._rung = rung
        return False

    def _down(self, now: float) -> Order:
        if self.state not in FOLLOWS:
            return Order.NO_TORQUE
        if self._stopping_since is None:
            self._stopping_since = now
        stopping = now - self._stopping_since < self.quick_stop
        return Order.QUICK_STOP if stopping else Order.NO_TORQUE

    @property
    def longer_pause(self) -> float:
        """How long it waits before the next reset of a drive that missed frames, s."""
        return self.pause * min(PATIENCE, 2 ** max(0, self.missed - self.resets))

    def _reset(self, now: float, missed: bool) -> Order:
        self._failed = self._retry_at is None or self._failed
        if now < self._pulse_until:
            return Order.RESET
        if self._retry_at is None:
            self._retry_at = now + (self.longer_pause if missed else self.pause)
        if now < self._retry_at:
            return Order.NO_TORQUE
        if missed:
            self.missed += 1
        elif self.tries >= self.resets:
            self.given_up = True
            return Order.NO_TORQUE
        else:
            self.tries += 1
        self._failed = False
        self._pulse_until = now + self.pulse
        self._retry_at = self._pulse_until + (self.longer_pause if missed else self.pause)
        return Order.RESET

    def _no_fault(self) -> None:
        self._retry_at = None
        self._pulse_until = -inf
