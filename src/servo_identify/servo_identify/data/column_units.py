"""Columns by DESIGN's names, with the units that a header may give them brought to SI."""

from __future__ import annotations

from collections import Counter
import re

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.straight_units import straightened
from servo_twin.recording.recording import COLUMNS

from .column_names import likely, NAMES, split, TIMES
from .physical_units import factor_to
from .table import Table
from .time_units import unit_of_stamps
from .unit_symbols import UnitError
from .unsigned import check_signed

UNIT = {'t': 's'} | COLUMNS
COMMANDS = ('voltage', 'added_command')
"""Columns in the unit of the command, which is A where the drive takes a current."""
CURRENTS = ('current', 'current_reference')
_OF_RATED = {'percent': re.compile(r'(?i)(%|percent).*'), 'per mille': re.compile(
    r'(?i)(0\.1 ?(%|percent)|\u2030|per ?mille|per thousand|1/1000).*')}
"""Units of a share of what a drive is rated for, as CiA 402 has torque and current."""
EFFECTIVE = ('it is the effective value of a sine: write A where the torque constant is given for '
             'that (N m/Arms), else 1.41421 A')
PEAK = ('it is the peak of a sine: write A where the torque constant is given for that, else '
        '0.707107 A where it is given for the effective value (N m/Arms)')
OF_SINES = (dict.fromkeys(('arms', 'aeff'), f'; {EFFECTIVE}')
            | dict.fromkeys(('apk', 'apeak', 'ap'), f'; {PEAK}'))
"""What is said of units of a current that is a sine, in small letters without blanks."""
_EXAMPLES = {'s': 'ms, us, ns', 'rad': 'deg, rev, 1/4096 rev (one count of an encoder)',
             'rad/s': 'deg/s, rpm, Hz (turns a second)', 'A': 'mA',
             'V': 'mV (a command may also be in A or mA)',
             'N m': 'mN m', 'degC': 'degC'}


def named_columns(table: Table, servo: Servo | None, told: list[str]) -> dict[str, np.ndarray]:
    """
    Return the columns of :data:`NAMES` in SI units: m and N of what moves straight of a servo.

    A header may give a unit, as in ``motor_position [deg]``: another than SI is converted, which
    is told. Raises ValueError for an unknown unit, a name given twice, negative numbers that were
    read as unsigned, and a column whose name looks like a missing one; others are left out, which
    is told.
    """
    found: dict[str, np.ndarray] = {}
    strangers: list[str] = []
    headers = [*table.columns, *table.refused]
    time = time_of(table)[0]
    for header in headers:
        name, unit = split(header)
        if header == time:
            name = 't'
        if name not in NAMES:
            strangers.append(header)
            continue
        if name in found:
            raise ValueError(f'{table.path}: column {name!r} is there twice')
        if header in table.begins:  # dates and times of a clock are in s by now
            unit = 's'
        unit = unit or name == 't' and unit_of_stamps(table.first(header)) or ''
        factor = factor_of(f'{table.path}: column {header!r}', name, unit, servo)
        if factor != 1.0:
            into = 'A' if is_current(name, unit) else (
                servo.reads(UNIT[name], name) if servo else UNIT[name])
            told.append(f'column {header!r} is converted to {into} by {factor:.9g}')
        check_signed(table.path, name, header, table[header])
        found[name] = table[header] * factor
    _judge_strangers(table, strangers, [name for name in NAMES if name not in found], told)
    return found


def time_of(table: Table) -> tuple[str, str]:
    """Return the header of the time and the unit that it gives; '' where there is none."""
    parted = {header: split(header) for header in (*table.columns, *table.refused)}
    for wanted in ('t', *TIMES):
        for header, (name, unit) in parted.items():
            if name == wanted or wanted != 't' and name.lower() == wanted:
                return header, unit
    return '', ''


def factor_of(where: str, name: str, unit: str, servo: Servo | None,
              either: bool = False) -> float:
    """
    Return what numbers in a unit are multiplied by; raises ValueError that begins by where.

    ``either``: no servo is known yet, so that a column may be of what moves straight.
    """
    wanted = UNIT[name]
    if not unit:
        return 1.0
    if is_current(name, unit):
        if servo is not None and not takes_current(servo):
            raise ValueError(f'{where} is in {unit!r}, and the drive of {servo.name} takes V. '
                             "What was measured in A is 'current'; a drive that takes a current "
                             'is of type current, with a gain in A/V')
        return factor_to(unit, 'A')
    try:
        return factor_to(unit, wanted)
    except UnitError as problem:
        said, hint = str(problem), ''
    try:
        factor = factor_to(unit, straightened(wanted))
    except UnitError:
        pass
    else:
        if either or servo is not None and servo.straight(name):
            return factor
        hint = ('; the motor of this axis turns, since its ratio is in rad/m'
                if servo is not None and servo.linear else
                '; a linear axis says so in its servo file: travel: linear')
    share = next((share for share, units in _OF_RATED.items() if units.fullmatch(unit)), '')
    if share and name in (*CURRENTS, 'torque'):
        part = 0.0127 if share == 'percent' else 0.00127
        hint += (f'; a share of the rated value is given as its part: {part} {wanted} for a '
                 f'{share} of 1.27 {wanted}')
    elif unit in ('%', 'percent'):
        hint += ('; leave the unit out and give scale: in the mapping, what 1 % is in '
                 f'{wanted}: scale: 0.08 where the whole is 8 {wanted}')
    if name in (*CURRENTS, *COMMANDS):
        hint += OF_SINES.get(re.sub('[ _]', '', unit.lower()), '')
    if name in (*CURRENTS, *COMMANDS) and _is_of(unit, 'N m'):
        hint += ('; leave the unit out and give the drive a torque constant of 1 N m/A, so that '
                 '1 A stands for 1 N m')
    raise ValueError(f'{where} is in {unit!r}, {name} is in {wanted}: {said}; known units are '
                     f'{wanted}, {_EXAMPLES[wanted]} and the like{hint}')


def takes_current(servo: Servo) -> bool:
    """Whether a command of 1 may be 1 A: the drive makes a current of it, by a gain in A/V."""
    gain = getattr(servo.drive, 'gain', None)
    return gain is not None and gain.unit == 'A/V'


def _is_of(unit: str, wanted: str) -> bool:
    try:
        return factor_to(unit, wanted) > 0.0
    except UnitError:
        return False


def is_current(name: str, unit: str) -> bool:
    """Tell whether a column is a command in A or mA, since its drive takes a current."""
    return name in COMMANDS and bool(unit) and _is_of(unit, 'A')


def _numbered(header: str) -> str:
    """Return the name of a column of several alike, which have numbers behind it; else ''."""
    found = re.fullmatch(r'(.+) \(\d+\)', header)
    return found[1] if found else ''


def _judge_strangers(table: Table, strangers: list[str], missing: list[str],
                     told: list[str]) -> None:
    meant = {header: likely(split(header)[0], missing) for header in strangers}
    doubtful = {header: name for header, name in meant.items() if name}
    twice = Counter(name for header in doubtful if (name := _numbered(header)))
    for name, count in twice.items():
        if count > 1:
            raise ValueError(f'{table.path}: the header names {name!r} {count} times, called '
                             f"'{name} (1)' to '{name} ({count})' here; rename what is not meant, "
                             'or choose one in a mapping file, which `servo-identify init` writes')
    if doubtful:
        first, *rest = doubtful.items()
        more = ''.join(f'; {header!r}: is it {name!r}?' for header, name in rest)
        raise ValueError(
            f'{table.path}: there is no column {first[0]!r}; is it {first[1]!r}?{more} Rename '
            'what is meant, or let `servo-identify init` write a mapping file that says so, and '
            f'give it (--mapping). Columns are {list(NAMES)}')
    if strangers:
        told.append(f'columns {strangers} are left out: they are none of {list(NAMES)}')
