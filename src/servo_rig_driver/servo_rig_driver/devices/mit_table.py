"""The table of one model of actuator in MIT mode: frames, ranges, states and faults, from YAML."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .bit_frames import bit_frame, BitFrame, Range
from .device import DeviceError
from .drive_master import DriveState
from .tables import MALFORMED, read_table

NEEDED = ('control', 'enable', 'stop', 'clear', 'feedback')
FIELDS = ('position', 'velocity', 'kp', 'kd', 'torque', 'time')
"""What a driver gives a frame beside the ids of drive and host."""
TOLD = {'position', 'velocity', 'torque', 'temperature', 'fault'}
"""What a feedback has to tell."""


@dataclass(frozen=True)
class MitTable:
    """
    What a model says on the wire.

    ``states`` maps the values of the feedback's field `mode` to states; a model without that
    field stands as it was told last. ``faults`` maps bits (``fault_bits``) or values of the field
    `fault` to words. ``wraps``: behind the end of its range the position goes on at the
    other end, it is not held there.
    """

    name: str
    extended: bool
    wraps: bool
    ranges: Mapping[str, Range]
    frames: Mapping[str, BitFrame]
    states: Mapping[int, DriveState]
    faults: Mapping[int, str]
    fault_bits: bool
    watchdog_rate: float = 0.0
    commands: tuple[str, ...] = field(default=())

    def state(self, told: Mapping[str, float], asked: str, was: DriveState
              ) -> tuple[DriveState, str]:
        """
        Return the state, and the fault in words, that a feedback tells.

        ``asked`` is the name of the frame that it answers, ``was`` the state before.
        """
        raw = int(told['fault'])
        if raw:
            return DriveState.FAULT, self.words(raw)
        if self.states:
            return self.states.get(int(told['mode']), DriveState.UNKNOWN), ''
        if asked == 'enable':
            return DriveState.OPERATION_ENABLED, ''
        if asked in ('stop', 'clear') or was is DriveState.FAULT:
            return DriveState.SWITCH_ON_DISABLED, ''
        return was, ''

    def words(self, raw: int) -> str:
        """Return a fault in words."""
        if not self.fault_bits:
            return self.faults.get(raw, f'error code {raw}')
        return ', '.join(self.faults.get(bit, f'fault bit {bit}')
                         for bit in range(raw.bit_length()) if raw >> bit & 1)


def load_mit_table(name: str) -> MitTable:
    """Return the table of a shipped model or of a file; raises DeviceError."""
    content = read_table(name, '.yaml')
    try:
        ranges = {key: Range(float(ends[0]), float(ends[1]))
                  for key, ends in content['ranges'].items()}
        extended = content['identifiers'] == 'extended'
        frames = {key: bit_frame(key, lines, ranges, 29 if extended else 11)
                  for key, lines in content['frames'].items()}
        missing = [key for key in NEEDED if key not in frames]
        if missing:
            raise DeviceError(f'{name}: it has no frame {missing}; needed are {list(NEEDED)}')
        ids = {'drive': 1, 'host': 0}
        for key in frames:  # so that none fails beside a motor
            if key != 'feedback':
                frames[key].pack(ids | dict.fromkeys(FIELDS, 0.0))
        told = frames['feedback'].fields
        if not TOLD <= told:
            raise DeviceError(f"{name}: frame 'feedback' lacks {sorted(TOLD - told)}")
        faults = content['faults']
        states = content.get('states') or {}
        if states and 'mode' not in told:
            raise DeviceError(f"{name}: 'states' are those of a field 'mode' of the frame "
                              "'feedback', which has none")
        return MitTable(
            name, extended, bool(content['position_wraps']), ranges, frames,
            {int(key): DriveState[value.upper()] for key, value in states.items()},
            {int(key): str(words) for key, words in faults['words'].items()},
            faults['by'] == 'bit', float(content.get('watchdog_rate', 0.0)),
            tuple(key for key in frames if key != 'feedback'))
    except MALFORMED as error:
        if isinstance(error, DeviceError):
            raise
        raise DeviceError(f'{name} is no table of an actuator in MIT mode: {error!r}') from error
