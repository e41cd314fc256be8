"""
Units as people write them, brought to SI: mH, g cm2, mohm, rpm/V, mN m/A, deg/s, 1/4096 rev.

A unit is a product of symbols with prefix and power, parted by blanks, dots or stars; what follows
a stroke divides. Numbers are factors, so `1/4096 rev` is one count of an encoder. An angle counts
as a number, as in SI: 1 rev is 2 pi.
"""

from __future__ import annotations

from difflib import get_close_matches
from math import pi
import re
from typing import NamedTuple


class Unit(NamedTuple):
    """A factor to SI, and the powers of kg, m, s and A."""

    factor: float
    powers: tuple[int, int, int, int]

    def times(self, other: Unit, power: int = 1) -> Unit:
        """Return the product with a power of another unit."""
        return Unit(self.factor * other.factor**power,
                    tuple(a + power * b for a, b in zip(self.powers, other.powers, strict=True)))


class UnitError(ValueError):
    """A unit that is not known, or of another quantity."""


_ONE = Unit(1.0, (0, 0, 0, 0))
_PREFIXES = {'n': 1e-9, 'u': 1e-6, 'µ': 1e-6, 'μ': 1e-6, 'm': 1e-3, 'c': 1e-2, 'd': 1e-1,
             'k': 1e3, 'M': 1e6, 'G': 1e9}
_VOLT, _NEWTON = (1, 2, -3, -1), (1, 1, -2, 0)
_PREFIXED = {
    'g': Unit(1e-3, (1, 0, 0, 0)), 'm': Unit(1.0, (0, 1, 0, 0)), 's': Unit(1.0, (0, 0, 1, 0)),
    'A': Unit(1.0, (0, 0, 0, 1)), 'V': Unit(1.0, _VOLT), 'N': Unit(1.0, _NEWTON),
    'Nm': Unit(1.0, (1, 2, -2, 0)), 'ohm': Unit(1.0, (1, 2, -3, -2)),
    'H': Unit(1.0, (1, 2, -2, -2)), 'F': Unit(1.0, (-1, -2, 4, 2)), 'W': Unit(1.0, (1, 2, -3, 0)),
    'J': Unit(1.0, (1, 2, -2, 0)), 'Hz': Unit(1.0, (0, 0, -1, 0)), 'rad': _ONE,
    'rpm': Unit(pi / 30, (0, 0, -1, 0)), 'gf': Unit(9.80665e-3, _NEWTON),
}
_PREFIXED |= {'\u03a9': _PREFIXED['ohm'], '\u2126': _PREFIXED['ohm'], 'Ohm': _PREFIXED['ohm']}
_PLAIN = {
    'deg': Unit(pi / 180, _ONE.powers), 'rev': Unit(2 * pi, _ONE.powers),
    'arcmin': Unit(pi / 10800, _ONE.powers), 'arcsec': Unit(pi / 648000, _ONE.powers),
    'min': Unit(60.0, (0, 0, 1, 0)), 'h': Unit(3600.0, (0, 0, 1, 0)),
    'in': Unit(0.0254, (0, 1, 0, 0)), 'lb': Unit(0.45359237, (1, 0, 0, 0)),
    'oz': Unit(0.028349523125, (1, 0, 0, 0)), 'lbf': Unit(4.4482216152605, _NEWTON),
    'ozf': Unit(0.27801385095, _NEWTON), '%': Unit(1e-2, _ONE.powers),
}
_PLAIN |= {'°': _PLAIN['deg'], 'degree': _PLAIN['deg'], 'degrees': _PLAIN['deg'],
           'turn': _PLAIN['rev'], 'turns': _PLAIN['rev'], 'r': _PLAIN['rev'],
           'sec': _PREFIXED['s'], 'seconds': _PREFIXED['s']}
_LOWER = {'v': 'V', 'a': 'A', 'mv': 'mV', 'ma': 'mA', 'kv': 'kV', 'nm': 'Nm', 'mnm': 'mNm',
          'knm': 'kNm', 'ncm': 'cNm', 'n': 'N', 'kn': 'kN', 'mh': 'mH', 'uh': 'uH'}
"""Spelled without capitals, where nothing else of that quantity is."""
_COUNTS = ('counts', 'count', 'cnt', 'ticks', 'tick', 'inc', 'increments', 'lsb')
_WHOLE = re.compile(r'\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![A-Za-z°])|[^\s·*./()^]+|\^|[·*]{1,2}|[/()]')


def factor_to(text: str, wanted: str) -> float:
    """
    Return what a number in the unit ``text`` is multiplied by to be in ``wanted``, an SI unit.

    A temperature in degC stays as it is. Raises UnitError for a unit that is not known and for
    one of another quantity; the error says what fits.
    """
    if wanted == 'rad/s' and text.replace(' ', '') in ('1/min', 'min-1', 'min^-1'):
        text = 'rpm'  # a speed in 1/min counts turns
    if wanted == 'degC':
        if text.replace('°', 'deg').lower() in ('degc', 'c'):
            return 1.0
        raise UnitError(f'{text!r} is no temperature in degC')
    try:
        found = parsed(text)
        unknown = None
    except UnitError as problem:
        found, unknown = None, problem
        if text.lower() not in _LOWER and text.lower() == text:
            raise
    goal = parsed(wanted)
    if found is None or found.powers != goal.powers:
        lower = ' '.join(_LOWER.get(word, word) for word in text.lower().split())
        try:
            second = None if lower == text else parsed(lower)
        except UnitError:
            second = None
        if second is None or second.powers != goal.powers:
            raise unknown or UnitError(f'{text!r} is no unit of {wanted}')
        found = second
    return found.factor / goal.factor


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
        raise UnitError(f'{text!r} has no unit; say {match[1]} {wanted}, or one that is of the '
                        'same quantity')
    if not wanted:
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


def parsed(text: str) -> Unit:
    """Return the factor and powers of a unit; raises UnitError."""
    plain = text.translate(str.maketrans({'²': '2', '³': '3', '⋅': ' '}))
    plain = re.sub(r'\^\s*|\*\*(?=-?\d)', '', plain).replace('/rad/s', '/(rad/s)')
    words = _WHOLE.findall(plain)
    found, at = _product(text, words, 0)
    if at != len(words) or not words:
        raise UnitError(f'{text!r} is no unit')
    return found


def _product(text: str, words: list[str], at: int) -> tuple[Unit, int]:
    """Read a product up to a closing bracket; a stroke divides by all up to the next stroke."""
    found, sign = _ONE, 1
    while at < len(words) and words[at] != ')':
        word = words[at]
        at += 1
        if word == '/':
            sign = -1
        elif word == '(':
            inner, at = _product(text, words, at)
            if at >= len(words):
                raise UnitError(f'{text!r}: a bracket is not closed')
            found, at = found.times(inner, sign), at + 1
        elif word[0] not in '·*^':
            found = found.times(_symbols(text, word), sign)
            if word.replace('.', '').isdigit():
                sign = 1  # 1/4096 rev: only the number divides
    return found, at


def _symbols(text: str, word: str) -> Unit:
    """Read symbols that may stand without a gap, as in Nms: the fewest, the longest first."""
    try:
        return Unit(float(word), _ONE.powers)
    except ValueError:
        pass
    for cut in range(len(word), 0, -1):
        first = _symbol(word[:cut])
        if first is not None:
            if cut == len(word):
                return first
            try:
                return first.times(_symbols(text, word[cut:]))
            except UnitError:
                continue
    if word.lower() in _COUNTS:
        raise UnitError('counts need to be told how many make a turn: write 1/4096 rev in place '
                        f'of {word}, with your own number')
    near = get_close_matches(word, [*_PREFIXED, *_PLAIN], 1, 0.6)
    raise UnitError(f'{text!r} is no unit that is known' + (f'; is it {near[0]!r}?' if near
                                                            else ''))


def _symbol(word: str) -> Unit | None:
    match = re.fullmatch(r'(\D+?)(-?\d)?', word)
    if not match:
        return None
    name, power = match[1], int(match[2] or 1)
    for spelled in (name, name.lower()):
        if spelled in _PREFIXED or spelled in _PLAIN:
            return _ONE.times((_PREFIXED | _PLAIN)[spelled], power)
        if spelled[:1] in _PREFIXES and spelled[1:] in _PREFIXED:
            unit = _PREFIXED[spelled[1:]]
            return _ONE.times(Unit(unit.factor * _PREFIXES[spelled[0]], unit.powers), power)
        if name[:1] in _PREFIXES and len(name) > 3:
            continue
        break
    return None
