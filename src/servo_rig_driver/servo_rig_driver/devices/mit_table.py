"""The table of one model of actuator in MIT mode: frames, ranges, states and faults, from YAML."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite

from .bit_frames import bit_frame, BitFrame, Range
from .device import DeviceError
from .drive_master import DriveState, MAY_PUSH
from .tables import MALFORMED, read_table

NEEDED = ('control', 'enable', 'stop', 'clear', 'feedback')
ANSWERS = ('feedback', 'turns_told')
LAW = ('position', 'velocity', 'kp', 'kd', 'torque')
"""What a command says: the drive's law has no other terms."""
FIELDS = (*LAW, 'time')
"""What a driver gives a frame beside the ids of drive and host."""
TOLD = {'position', 'velocity', 'torque', 'temperature', 'fault', 'drive'}
"""What a feedback has to tell."""
TURNS = {'turns': {'drive'}, 'turns_told': {'drive', 'angle'}}
"""The question for the angle that a drive has counted, and its answer: a float of 32 bits."""
BOTH_SIDES, GAINS = ('position', 'velocity', 'torque'), ('kp', 'kd')
RANGES = (*BOTH_SIDES, *GAINS, 'temperature')
"""Fields that are numbers of a range: without one, a torque of 0 would be the lowest one."""
ENTRIES = ('identifiers', 'position_wraps', 'ranges', 'frames', 'states', 'faults',
           'watchdog_rate')


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

    def state(self, told: Mapping[str, float], was: DriveState) -> tuple[DriveState, str]:
        """Return the state, and the fault in words, that a feedback tells; ``was``: before it."""
        raw = int(told['fault'])
        mode = self.states.get(int(told['mode']), DriveState.UNKNOWN) if self.states else None
        if raw:
            failing = mode is not None and mode in MAY_PUSH  # it is told to stop, then reset
            return (DriveState.FAULT_REACTION_ACTIVE if failing else DriveState.FAULT,
                    self.words(raw))
        if mode is not None:
            return mode, ''
        return DriveState.SWITCH_ON_DISABLED if was is DriveState.FAULT else was, ''

    def led_to(self, frame: str, was: DriveState) -> DriveState:
        """Return the state of a drive that tells none, once it has answered a frame."""
        if was is DriveState.FAULT:
            return was
        if frame == 'enable':
            return DriveState.OPERATION_ENABLED
        return DriveState.SWITCH_ON_DISABLED if frame in ('stop', 'clear') else was

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
        unknown = sorted(content.keys() - set(ENTRIES))
        if unknown:
            raise DeviceError(f'{name}: it has no entry {unknown}; entries are {list(ENTRIES)}')
        ranges = _ranges(name, content['ranges'])
        extended = _choice(name, content, 'identifiers', ('standard', 'extended')) == 'extended'
        wraps = _choice(name, content, 'position_wraps', (True, False))
        frames = {key: bit_frame(key, lines, ranges, 29 if extended else 11)
                  for key, lines in content['frames'].items()}
        _check_frames(name, frames)
        faults, states = content['faults'], content.get('states') or {}
        if states and 'mode' not in frames['feedback'].fields:
            raise DeviceError(f"{name}: 'states' are those of a field 'mode' of the frame "
                              "'feedback', which has none")
        rate = float(content.get('watchdog_rate', 0.0))
        if 'watchdog' in frames and not (isfinite(rate) and rate > 0.0):
            raise DeviceError(f"{name}: watchdog_rate = {rate:g} counts a second; the frame "
                              "'watchdog' needs one above 0, or the drive would have none")
        return MitTable(
            name, extended, wraps, ranges, frames,
            {int(key): DriveState[value.upper()] for key, value in states.items()},
            {int(key): str(words) for key, words in faults['words'].items()},
            _choice(f'{name}: faults', faults, 'by', ('bit', 'value')) == 'bit', rate,
            tuple(key for key in frames if key not in ANSWERS))
    except MALFORMED as error:
        if isinstance(error, DeviceError):
            raise
        raise DeviceError(f'{name} is no table of an actuator in MIT mode: {error!r}') from error


def _choice(name: str, of: Mapping, key: str, choices: tuple) -> bool | str:
    value = of.get(key)
    if value not in choices or type(value) is not type(choices[0]):
        raise DeviceError(f'{name}: {key} = {value!r}; it is one of {list(choices)}')
    return value


def _ranges(name: str, given: Mapping) -> dict[str, Range]:
    """Return the ranges by field, each of which holds the 0 by which a drive is at rest."""
    if set(given) != set(RANGES):
        raise DeviceError(f'{name}: ranges are given of {sorted(given)}; they are needed of '
                          f'{list(RANGES)} and of no other field')
    ranges = {key: Range(float(ends[0]), float(ends[1])) for key, ends in given.items()}
    for key in BOTH_SIDES:
        if not ranges[key].low < 0.0 < ranges[key].high:
            raise DeviceError(f'{name}: range [{ranges[key].low:g}, {ranges[key].high:g}] of '
                              f'{key} has no 0 within; a drive at rest could not be told so')
    for key in GAINS:
        if ranges[key].low != 0.0:
            raise DeviceError(f'{name}: range of {key} begins at {ranges[key].low:g}; a gain '
                              'begins at 0, by which it is off')
    return ranges


def _check_frames(name: str, frames: Mapping[str, BitFrame]) -> None:
    """Raise DeviceError for frames that would fail, or mean another thing, beside a motor."""
    missing = [key for key in NEEDED if key not in frames]
    if missing:
        raise DeviceError(f'{name}: it has no frame {missing}; needed are {list(NEEDED)}')
    needed = {key: {'drive'} for key in frames} | {
        'control': {'drive', *LAW}, 'feedback': TOLD, **TURNS}
    alone = [key for key in TURNS if key in frames]
    if len(alone) == 1:
        raise DeviceError(f"{name}: frame '{alone[0]}' stands alone; {list(TURNS)} go together")
    for key, frame in frames.items():
        if not needed[key] <= frame.fields:
            raise DeviceError(f"{name}: frame '{key}' lacks {sorted(needed[key] - frame.fields)}")
        if any(field.name == 'angle' and (field.bits, field.constant) != (32, None)
               for field in frame.data.fields):
            raise DeviceError(f"{name}: field 'angle' of frame '{key}' is a float of 32 bits")
        if key not in ANSWERS:
            frame.pack({'drive': 1, 'host': 0} | dict.fromkeys(FIELDS, 0.0))
