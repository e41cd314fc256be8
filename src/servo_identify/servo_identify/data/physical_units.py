"""
Units as people write them, brought to SI: mH, g cm2, mohm, rpm/V, mN m/A, deg/s, 1/4096 rev.

What is written is read in unit_symbols.py. An angle is a dimension of its own here: N m/rad is no
N m.
"""

from __future__ import annotations

from collections.abc import Iterator
import re

from .unit_symbols import CountsError, parsed, Unit, UnitError

_LOWER = {'v': 'V', 'a': 'A', 'mv': 'mV', 'ma': 'mA', 'kv': 'kV', 'nm': 'Nm', 'mnm': 'mNm',
          'knm': 'kNm', 'ncm': 'cNm', 'n': 'N', 'kn': 'kN', 'mh': 'mH', 'uh': 'uH'}
"""Spelled without capitals, where nothing else of that quantity is."""

_COUNT = {'rad': '1/4096 rev', 's': '2 ms', 'A': '2.69 mA', 'V': '0.8 mV', 'm': '5 um',
          'N m': '3 mN m', 'rad/s': '1/4096 rev/s'}
"""What one count may be, of each quantity."""


def factor_to(text: str, wanted: str) -> float:
    """
    Return what a number in the unit ``text`` is multiplied by to be in ``wanted``, an SI unit.

    A frequency is turns where ``wanted`` holds an angle (1 Hz is 2 pi rad/s, 1 Hz/V is 2 pi rad/s
    a volt), and where it is a torque constant; where a rate is wanted (1/s, Hz) it is that.

    An angle may be left out, or be there beside ``wanted``, where a symbol of time says that the
    unit is of a speed. People write V s for V s/rad, N m s for N m s/rad, 1/s for rad/s, V s/rad
    for N m/A and N m s2/rad for kg m2. Where none does, N m is no stiffness and N m/rad no torque.

    A time in MS or MSEC is in ms. A temperature in degC stays as it is. Raises UnitError for a
    unit that is not known and for one of another quantity; the error says what fits.
    """
    if wanted == 'degC':
        if text.replace('°', 'deg').lower() in ('degc', 'c'):
            return 1.0
        raise UnitError(f'{text!r} is no temperature in degC; leave the unit out and give steps '
                        'in the mapping: offset: -273.15 of K, scale: 0.5556 and offset: -17.78 '
                        'of degF')
    try:
        return _factor(text, wanted)
    except CountsError as problem:
        raise CountsError(problem.word, _COUNT.get(wanted, f'0.01 {wanted}')) from None
    except UnitError as problem:
        first = problem
    lower = _in_small(text)
    try:
        factor = _factor(lower, wanted)
    except UnitError:
        raise first from None
    if wanted != 's' and _may_be_mega(text):
        raise UnitError(f'{text!r} may be of a million or of a thousandth; is it {lower!r}?')
    return factor


def without_case(unit: str, header: str) -> str:
    """
    Return the unit of a header that is in capitals throughout, with its M read as milli: MA is mA.

    Such a header has no case to tell m from M, and no channel of a servo is in millions. The unit
    of any other header stays as it is.
    """
    return _in_small(unit) if header.isupper() and _may_be_mega(unit) else unit


def _in_small(unit: str) -> str:
    """Return a unit in small letters, but for symbols that are nothing without their capitals."""
    return ' '.join(_LOWER.get(word, word) for word in unit.lower().split())


def _may_be_mega(unit: str) -> bool:
    return any(word[0] == 'M' and word[1:] not in ('', 'in', 'IN') for word in unit.split())


def _factor(text: str, wanted: str) -> float:
    """Return the factor of a unit that is spelled right; raises UnitError."""
    for found, goal, exact in _readings(text, wanted):
        if found.powers == goal.powers and (found.angle == goal.angle or not exact and (
                found.timed or goal.timed) and 0 in (found.angle, goal.angle)):
            return found.factor / goal.factor
    said = f'{text!r} is no unit of {wanted}'
    found, goal = parsed(text), parsed(wanted)
    if found.powers == goal.powers:
        raise UnitError(f'{said}: ' + ('it lacks the angle' if not found.angle else
                                       'it is of an angle' if not goal.angle else
                                       'the angle is in it with another power'))
    forces = re.sub(r'(?<![A-Za-z])(k?g|oz|lb)(?!f)', r'\1f', text)
    if parsed(forces).powers == goal.powers:
        said += f'; is it {forces!r}, with the f of a force?'
    raise UnitError(said)


def _readings(text: str, wanted: str) -> Iterator[tuple[Unit, Unit, bool]]:
    """Yield both units, likeliest reading first, and whether their angles must be the same."""
    turned, plain = (parsed(text, True), parsed(wanted, True)), (parsed(text), parsed(wanted))
    rate = plain[1].timed and not plain[1].angle
    for (found, goal), exact in (
            [(plain, True), (turned, True), (turned, False), (plain, False)] if rate else
            [(turned, True), (turned, False), (plain, True), (plain, False)]):
        yield found, goal, exact


def value_in(text: str, wanted: str) -> float:
    """
    Return a number with its unit, such as '1.2 mH', in ``wanted``.

    A speed constant (rpm/V) is understood where a back EMF or a torque constant is wanted, and a
    lead (mm/rev) where a ratio in rad/m is: it is their inverse. The gain of a drive whose command
    is a current may be in A/A: one unit of command counts as one volt. Raises UnitError for text
    that is no number, a unit that is missing, unknown or of another quantity.
    """
    match = re.match(r'\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*$', text)
    if not match:
        raise UnitError(f'{text!r} is no number' + (f' with a unit of {wanted}' if wanted else ''))
    number, unit = float(match[1]), match[2]
    if not unit:
        if wanted in ('', 'V/V'):
            return number
        asked = f', or {match[1]} A/A where the command is a current' if wanted == 'A/V' else ''
        raise UnitError(f'{text!r} has no unit; say {match[1]} {wanted}{asked}, or one that is '
                        'of the same quantity')
    if not wanted:
        if _of(unit, 'rad/m') or _of(unit, 'm/rad'):
            raise UnitError(f'{text!r} is the ratio of an axis that moves straight: say --linear, '
                            'or travel: linear in the servo file; one that turns has no unit')
        return number * factor_to(unit, '1')
    try:
        return number * factor_to(unit, wanted)
    except UnitError:
        if wanted == 'A/V' and _of(unit, '1') is not None:
            return number * factor_to(unit, '1')
        inverse = (wanted in ('V s/rad', 'N m/A') and _of(unit, 'rad/s/V')
                   or wanted == 'rad/m' and _of(unit, 'm/rad'))
        if inverse and number > 0.0:
            return 1.0 / (number * inverse)
        raise


def _of(unit: str, wanted: str) -> float | None:
    try:
        return factor_to(unit, wanted)
    except UnitError:
        return None
