"""
The drive state machine of CiA 402, seen from the master: statusword in, controlword out.

Pure logic: no bus, no clock; time is handed in, in seconds. Source: CiA 402-2 (IEC 61800-7-201),
tables "state coding" of object 6041h and "command coding" of object 6040h.
"""

from __future__ import annotations

from enum import Enum, IntEnum
from math import inf


class DriveState(Enum):
    """The states of a CiA 402 drive: (mask of the statusword, value under the mask)."""

    NOT_READY = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY_TO_SWITCH_ON = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    OPERATION_ENABLED = (0x6F, 0x27)
    QUICK_STOP_ACTIVE = (0x6F, 0x07)
    FAULT_REACTION_ACTIVE = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)
    UNKNOWN = (0x00, 0x01)

    @property
    def words(self) -> str:
        """The name as people write it."""
        return self.name.replace('_', ' ').lower()


class Controlword(IntEnum):
    """The commands of object 6040h that a master needs."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80


def _decode(statusword: int) -> DriveState:
    for state in DriveState:
        mask, value = state.value
        if statusword & mask == value:
            return state
    return DriveState.UNKNOWN


_STATES = tuple(_decode(low) for low in range(0x80))


def drive_state(statusword: int) -> DriveState:
    """Return the state that a statusword (object 6041h) tells; the upper bits do not matter."""
    return _STATES[statusword & 0x7F]


_UPWARD = {
    DriveState.NOT_READY: Controlword.DISABLE_VOLTAGE,
    DriveState.SWITCH_ON_DISABLED: Controlword.SHUTDOWN,
    DriveState.READY_TO_SWITCH_ON: Controlword.SWITCH_ON,
    DriveState.SWITCHED_ON: Controlword.ENABLE_OPERATION,
    DriveState.OPERATION_ENABLED: Controlword.ENABLE_OPERATION,
    DriveState.QUICK_STOP_ACTIVE: Controlword.DISABLE_VOLTAGE,
    DriveState.FAULT_REACTION_ACTIVE: Controlword.DISABLE_VOLTAGE,
    DriveState.UNKNOWN: Controlword.DISABLE_VOLTAGE,
}


class DriveMaster:
    """
    Leads a drive to OPERATION ENABLED, or away from it, one controlword at a time.

    A fault is reset by a rising edge of controlword bit 7, held for ``pulse`` seconds; before each
    try the master waits ``pause`` seconds, and after ``resets`` tries it gives up. Tries are
    forgiven once the drive has been enabled for ``forgive`` seconds on end.

    A drive that follows its reference is taken down in order: quick stop, by which it brakes under
    its own ramp, and no torque once it says that it has stopped, at the latest ``quick_stop``
    seconds after.
    """

    def __init__(self, resets: int = 5, pause: float = 0.5, pulse: float = 0.05,
                 forgive: float = 10.0, quick_stop: float = 0.5) -> None:
        self.resets = resets
        self.pause = pause
        self.pulse = pulse
        self.forgive = forgive
        self.quick_stop = quick_stop
        self.enable = False
        self.state = DriveState.UNKNOWN
        self.tries = 0
        self._enabled_since: float | None = None
        self._stopping_since: float | None = None
        self._no_fault()

    @property
    def enabled(self) -> bool:
        """Whether the drive follows its reference, as far as its last statusword tells."""
        return self.enable and self.state is DriveState.OPERATION_ENABLED

    @property
    def given_up(self) -> bool:
        """Whether the drive is in fault and all resets have been tried."""
        return (self.state is DriveState.FAULT and self.tries >= self.resets
                and self._retry_at is None)

    def forget(self) -> None:
        """Start over, as after a restart of the rig; the tries used up stay used up."""
        self.state = DriveState.UNKNOWN
        self._enabled_since = None
        self._no_fault()

    def step(self, statusword: int, now: float) -> int:
        """
        Return the controlword that answers a statusword.

        ``now`` is any steady time, s. With ``enable`` false the drive is led by a quick stop to
        SWITCH ON DISABLED, and a fault is left as it is.
        """
        self.state = drive_state(statusword)
        if self.state is not DriveState.OPERATION_ENABLED:
            self._enabled_since = None
        elif self._enabled_since is None:
            self._enabled_since = now
        elif now - self._enabled_since >= self.forgive:
            self.tries = 0
        if not self.enable:
            return self._down(now)
        self._stopping_since = None
        if self.state is DriveState.FAULT:
            return self._reset(now)
        self._no_fault()
        return _UPWARD[self.state]

    def _down(self, now: float) -> int:
        if self.state not in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE):
            return Controlword.DISABLE_VOLTAGE
        if self._stopping_since is None:
            self._stopping_since = now
        stopping = now - self._stopping_since < self.quick_stop
        return Controlword.QUICK_STOP if stopping else Controlword.DISABLE_VOLTAGE

    def _reset(self, now: float) -> int:
        if now < self._pulse_until:
            return Controlword.FAULT_RESET
        if self._retry_at is None and self.tries < self.resets:
            self._retry_at = now + self.pause
        if self._retry_at is None or now < self._retry_at:
            return Controlword.DISABLE_VOLTAGE
        if self.tries >= self.resets:
            self._retry_at = None
            return Controlword.DISABLE_VOLTAGE
        self.tries += 1
        self._pulse_until = now + self.pulse
        self._retry_at = self._pulse_until + self.pause
        return Controlword.FAULT_RESET

    def _no_fault(self) -> None:
        self._retry_at = None
        self._pulse_until = -inf
