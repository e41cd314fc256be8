"""Which column people mean by a name, whatever its language, of a table or a message."""

from __future__ import annotations

from difflib import get_close_matches
import re

from servo_twin.recording.recording import COLUMNS

from .east_asian import names_in_english, units_in_symbols
from .european import bare, symbols_of, words_in_english
from .physical_units import without_case

NAMES = ('t', *COLUMNS)

TIMES = ('time', '__time', 'x_value', 'timestamp')
"""Other names of the time that leave no doubt, in small letters."""
ALSO = {'stamp': 't', 'u': 'voltage', 'v': 'voltage', 'volt': 'voltage', 'volts': 'voltage',
        'pwm': 'voltage', 'command': 'voltage', 'i': 'current', 'theta': 'motor_position',
        'theta_m': 'motor_position', 'q': 'load_position', 'theta_l': 'load_position',
        'tau': 'torque', 'q_ref': 'reference_position'}
"""What others call a column, and it may be another one as well."""
ANGLE = 'an angle'  # of one shaft or the other: the name does not say of which
TORQUE = 'a torque'  # of a sensor, or computed from the current: the name does not say which
TOLD_TORQUE = 'a torque that was told'  # the command of a drive, in N m

_TIME = {'t', 'time', '__time', 'timestamp', 'stamp', 'clock', 'seconds', 'utc', 'ts', 'tout',
         'millis', 'micros'}
SPEED = {'velocity', 'velo', 'vel', 'speed', 'omega', 'rpm', 'qd', 'dq', 'velocities', 'qvel',
         'rate'}
_REFERENCE = {'ref', 'reference', 'target', 'desired', 'setpoint', 'goal', 'des', 'input'}
_TOLD = {'command', 'commands', 'cmd', 'commanded', 'demand', 'demanded', 'set', 'action'}
"""What a drive was told; of an angle or a speed that is a reference."""
_CURRENT = {'current', 'i', 'iq', 'im', 'amps', 'ampere', 'cur', 'curr'}
_TORQUE = {'torque', 'tau', 'moment', 'force', 'effort', 'efforts'}
_DOUBTFUL = {'tau', 'effort', 'efforts', 'est', 'estimate', 'estimated', 'calc', 'calculated',
             'computed', 'actual', 'act', 'feedback', 'motor'}
"""Words beside a torque that a drive computes from its current, where no sensor is named."""
_MEASURED = {'sensor', 'cell', 'flange', 'transducer', 'gauge', 'measured', 'meas', 'mess',
             'external', 'ext'}
_VOLTAGE = {'voltage', 'volt', 'volts', 'u', 'uq', 'vq'}
_SHARE = {'pwm', 'duty'}
_COMMAND = _VOLTAGE | _SHARE | {'v', 'vm', 'command', 'commands', 'cmd', 'ctrl'}
_FORCES = ('N', 'kN')
"""Units with which a tension is that of a rope."""
_SUPPLY = {'bus', 'supply', 'battery', 'vbus', 'dc'}
_NEITHER = {'error', 'acceleration', 'force', 'kp', 'kd', 'ki', 'gain'}
_COUNTED = {'index', 'idx', 'id', 'frame', 'episode', 'task', 'row', 'sample', 'seq', 'done',
            'reward', 'success', 'mode', 'flag', 'flags', 'error', 'errors', 'dir', 'direction'}
"""Words of what counts rows, runs and faults, and is no quantity of a machine."""
_POSITION = {'position', 'pos', 'angle', 'theta', 'q', 'phi', 'encoder', 'enc', 'counts', 'ticks',
             'positions', 'estimate', 'qpos'}
_QUANTITIES = _TIME | SPEED | _CURRENT | _TORQUE | _SUPPLY | _NEITHER | _POSITION | (
    _COMMAND - _TOLD)
_DESIRED = re.compile(r'(?<![a-z])(d?q|tau(?:_j)?)_d(?![a-z])')
"""Names of what is desired, as equations have it: q_d."""
_NUMBERED = (_QUANTITIES | {'actual', 'desired', 'ref', 'reference', 'target'}) - _TIME
"""Words that the number of a joint may follow."""
_OF_MOTORS = re.compile(r'motor_?(?=(?:states?|cmds?|commands?)\b)', re.IGNORECASE)
"""How logs of legged robots call their actuators; the angle in it is that of the joint."""
_LEROBOT = re.compile(r'observation\.\w+|action')
"""Features of LeRobot: in brackets behind them stands which joint, and no unit."""
_ELECTRICAL = ('elec', 'elek', 'elett')
"""How words for electrical begin in English, German, Italian and more."""
_OF_FIELD = re.compile(r'(?:^|_)(theta|phi)_?el?$')
"""Symbols of the electrical angle."""
_OTHERS = '[^a-z\u00df-\u024f\u0400-\u04ff0-9_]+'
"""What parts words: all but letters of Latin and Cyrillic, digits and lines below."""
_IN_ANGLES = re.compile(r'_(deg|m?rad)$')
"""Names that end with the unit of an angle: AZ_deg."""
_UNITS = {'angle': ('deg', '°', 'grad', 'rad', 'mrad', 'rev', 'turns', 'count', 'counts', 'cnt',
                    'cnts', 'inc', 'incs', 'ticks', 'pulse', 'pulses'),
          'speed': ('rpm', 'deg/s', 'rad/s', '°/s', 'rev/s', 'u/min', '1/min', 'min-1'),
          'current': ('a', 'ma', 'arms', 'amps')}
_ABSCISSA, _OF_TIME = {'x', 'axis'}, ('s', 'ms', 'us', 'µs', 'sec', 'second', 'seconds')
"""How an oscilloscope calls its time, and what its unit then is."""
_OF_UNIT = {unit: word for word, units in _UNITS.items() for unit in units}
"""What a unit behind a name says of the quantity, where the name does not."""
_MOTOR, _LOAD = {'motor', 'rotor', 'm', 'mot'}, {'load', 'joint', 'output', 'link', 'l', 'arm',
                                                'joints', 'qpos'}


def split(header: str) -> tuple[str, str]:
    """Return the name and the unit of a header; '' where it gives none. In capitals MA is mA."""
    match = re.fullmatch(r'\s*(.+?)\s*[\[(（【]\s*([^\[\]]*?)\s*[\])）】]\s*', header)
    if match and match[2] and not (match[2].isdigit() or _LEROBOT.fullmatch(match[1])):
        return match[1], without_case(match[2], header)
    return header.strip(), ''


def looks_like(source: str, kind: str = '') -> str:
    """Return the column that a source looks like by its name, :data:`ANGLE`, or ''."""
    # of a message an index names the joint, but behind .values the interface
    bare = re.sub(r'(?<!\.values)\[[^\]]*\]', '', source)
    name, unit = (bare, '') if kind else split(source)
    name, unit = names_in_english(name), symbols_of(units_in_symbols(unit))
    if name in NAMES:
        return name
    name = _OF_MOTORS.sub('', name)
    words = _words(name) - (_VOLTAGE if unit in _FORCES else set())
    words -= {'q'} if words & (_VOLTAGE | {'v'}) else set()  # u_q: the axis of a motor, no angle
    words |= {'angle'} if _IN_ANGLES.search(name.lower()) else set()
    if not words & _QUANTITIES and name.partition('[')[0] in ('observation.state', 'action'):
        words |= {'angle'}
    if unit.lower() in _OF_UNIT and not words & _QUANTITIES:
        words |= {_OF_UNIT[unit.lower()]}
    if words <= _ABSCISSA and unit.lower() in _OF_TIME:
        return 't'
    if name.lower() in TIMES or words & _TIME and not words & _POSITION:
        return 't'
    if not kind and name.lower().rpartition('.')[2] in TIMES:  # a signal that has its own times
        return 't'
    if words & {'temp', 'temperature'}:
        return 'temperature'
    if kind.endswith('JointState') and words & {'position'}:
        return 'load_position'
    if words & _REFERENCE:
        return _reference(words)
    if words & _TOLD and words & (SPEED | _POSITION):
        return 'reference_velocity' if words & SPEED else 'reference_position'
    if words & (SPEED | _SUPPLY | _NEITHER):
        return ''
    if words & _CURRENT:
        return 'current' if not words & _TOLD else 'current_reference'
    if words & _TORQUE:
        if words & _TOLD:
            return TOLD_TORQUE
        if words & _DOUBTFUL and not words & _MEASURED:
            return TORQUE
        return 'external_torque' if words & {'external', 'ext'} else 'torque'
    if words & _POSITION:
        field = _words(name.partition('.')[2]) if kind else words  # a topic is no shaft
        if field & _MOTOR:
            return 'motor_position'
        return 'load_position' if field & _LOAD or words == {'q'} else ANGLE
    return 'voltage' if words & _COMMAND else ''


def _reference(words: set[str]) -> str:
    """Return the column of what was wanted."""
    for found, column in ((SPEED, 'reference_velocity'), (_CURRENT, 'current_reference'),
                          (_POSITION, 'reference_position')):
        if words & found:
            return column
    if words & (_VOLTAGE | _SHARE) and 'input' not in words:  # told, and no supply
        return 'voltage'
    return TOLD_TORQUE if words & _TORQUE and not words & _NEITHER else ''


def _words(name: str) -> set[str]:
    parts = {part for word in _parted(name) for part in words_in_english(word)}
    # of joints side by side a table has q1, q2 ...; t1 may be a temperature
    return parts | {word for part in parts if (word := part.rstrip('0123456789')) in _NUMBERED}


def _parted(name: str) -> list[str]:
    """Return the words of a name in small letters without accents, in their own language."""
    parted = bare(re.sub(r'(?<=[^\W\d_A-ZÀ-ÖØ-Þ])(?=[A-ZÀ-ÖØ-Þ])', '_', name))
    words = re.split(rf'{_OTHERS}|(?<=[^\W_])_', _DESIRED.sub(r'\1_desired', parted))
    return [word for one in words if (word := one.lstrip('_'))]  # _time of InfluxDB


def _is_foreign(name: str) -> bool:
    """Tell whether a name has words of another language than English."""
    return names_in_english(name) != name or any(
        words_in_english(word) != [word] for word in _parted(name))


def is_no_angle(source: str) -> bool:
    """Tell whether a name says that a source is a speed, a supply, a gain or a count of rows."""
    return not looks_like(source) and bool(
        _words(split(source)[0]) & (SPEED | _SUPPLY | _NEITHER | _COUNTED))


def is_speed(source: str) -> bool:
    """Tell whether a name says that a source is a speed."""
    return bool(_words(split(source)[0]) & SPEED)


def is_effective(source: str) -> bool:
    """Tell whether a name says that a source is the effective value of a sine."""
    return bool(_words(split(source)[0]) & {'rms', 'eff', 'effective'})


def is_electrical(source: str) -> bool:
    """Tell whether an angle is electrical by its name: it turns pole pairs times as often."""
    words = _parted(split(source)[0])
    return any(word.startswith(_ELECTRICAL) for word in words) or bool(
        _OF_FIELD.search('_'.join(words)))


def is_share(source: str) -> bool:
    """Tell whether a command is a share of the supply by its name: a duty, or counts of a PWM."""
    return bool(_words(split(source)[0]) & _SHARE)


def likely(name: str, missing: list[str]) -> str:
    """Return the missing column that a name looks like, misspelt or in other words, or ''."""
    lower = name.lower()
    also = ALSO.get(lower) or ('t' if lower in TIMES else None)
    if also in missing:
        return str(also)
    words = set(lower.split('_')) - {'reference', 'position'}
    near = [*get_close_matches(lower, missing, 1, 0.7),
            *(one for one in missing if words & set(one.split('_')))]
    meant = looks_like(name)
    if meant == ANGLE:
        shafts = [one for one in ('motor_position', 'load_position') if one in missing]
        return next((one for one in (*near, *shafts) if one in shafts), '') if near else ''
    if meant or _words(name) & (SPEED | _SUPPLY | _NEITHER | _TOLD):
        return meant if meant in missing and (near or _is_foreign(name)) else ''
    return near[0] if near else ''
