"""
The state machine of a CiA 402 drive as the drive has it: controlword in, statusword out.

Pure logic: no bus, no clock. Source: CiA 402-2 (IEC 61800-7-201), state machine of the drive.
"""

from __future__ import annotations

SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP, FAULT = (
    'switch on disabled', 'ready to switch on', 'switched on', 'operation enabled',
    'quick stop active', 'fault')

_WORDS = {SWITCH_ON_DISABLED: 0x0240, READY: 0x0221, SWITCHED_ON: 0x0233, ENABLED: 0x0237,
          QUICK_STOP: 0x0217, FAULT: 0x0208}
_FOLLOWS = 0x1000  # bit 12: drive follows the command value

# (mask of the controlword, value under the mask): command
_COMMANDS = (((0x82, 0x00), 'disable voltage'), ((0x86, 0x02), 'quick stop'),
             ((0x87, 0x06), 'shutdown'), ((0x8F, 0x07), 'switch on'), ((0x8F, 0x0F), 'enable'))

_TRANSITIONS = {
    (SWITCH_ON_DISABLED, 'shutdown'): READY,
    (READY, 'switch on'): SWITCHED_ON,
    (READY, 'enable'): ENABLED,
    (READY, 'quick stop'): SWITCH_ON_DISABLED,
    (SWITCHED_ON, 'enable'): ENABLED,
    (SWITCHED_ON, 'shutdown'): READY,
    (SWITCHED_ON, 'quick stop'): SWITCH_ON_DISABLED,
    (ENABLED, 'switch on'): SWITCHED_ON,
    (ENABLED, 'shutdown'): READY,
    (ENABLED, 'quick stop'): QUICK_STOP,
    **{(state, 'disable voltage'): SWITCH_ON_DISABLED
       for state in (READY, SWITCHED_ON, ENABLED, QUICK_STOP)},
}


class DriveStates:
    """
    The state of one drive; ``error`` is its error code (603Fh), 0 without a fault.

    A fault is left by a rising edge of bit 7 of the controlword, never by itself.
    """

    def __init__(self) -> None:
        self.state = SWITCH_ON_DISABLED
        self.error = 0
        self._last_word = 0

    @property
    def enabled(self) -> bool:
        """Whether the drive follows its set-points."""
        return self.state is ENABLED

    @property
    def gives_torque(self) -> bool:
        """Whether the motor has current: enabled, or braking by a quick stop."""
        return self.state in (ENABLED, QUICK_STOP)

    @property
    def statusword(self) -> int:
        """Object 6041h."""
        return _WORDS[self.state] | (_FOLLOWS if self.state is ENABLED else 0)

    def command(self, word: int) -> None:
        """Take a controlword; what does not fit the state is ignored, as drives do."""
        rising = word & 0x80 and not self._last_word & 0x80
        self._last_word = word
        if self.state is FAULT:
            if rising:
                self.state, self.error = SWITCH_ON_DISABLED, 0
            return
        for (mask, value), name in _COMMANDS:
            if word & mask == value:
                self.state = _TRANSITIONS.get((self.state, name), self.state)
                return

    def fail(self, error: int) -> None:
        """Go to fault with an error code; the first error stays."""
        if self.state is not FAULT:
            self.state, self.error = FAULT, error

    def stopped(self) -> None:
        """Say that a quick stop has come to rest: the drive switches off."""
        if self.state is QUICK_STOP:
            self.state = SWITCH_ON_DISABLED

    def switch_off(self) -> None:
        """Leave operation without an error, as when the node stops being operational."""
        if self.state is not FAULT:
            self.state = SWITCH_ON_DISABLED
