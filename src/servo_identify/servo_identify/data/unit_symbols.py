"""
Symbols of units with prefix and power, and products of them: g cm2, V/krpm, mN m/A, 1/4096 rev.

A unit is a product of symbols with prefix and power, parted by blanks, dots, stars or hyphens;
what follows a stroke divides. Numbers are factors, so `1/4096 rev` is one count of an encoder.
"""

from __future__ import annotations

from contextlib import suppress
from difflib import get_close_matches
from functools import lru_cache
from math import pi
import re
from typing import NamedTuple

from .east_asian import units_in_symbols
from .european import symbols_of


class Unit(NamedTuple):
    """
    A factor to SI, the powers of kg, m, s and A, and that of rad.

    ``timed`` says that a symbol of time or of its inverse is in it: s, min, Hz, rpm.
    """

    factor: float
    powers: tuple[int, int, int, int]
    angle: int = 0
    timed: bool = False

    def times(self, other: Unit, power: int = 1) -> Unit:
        """Return the product with a power of another unit."""
        return Unit(self.factor * other.factor**power,
                    tuple(a + power * b for a, b in zip(self.powers, other.powers, strict=True)),
                    self.angle + power * other.angle, self.timed or other.timed)


class UnitError(ValueError):
    """A unit that is not known, or of another quantity."""


class CountsError(UnitError):
    """Counts, of which nothing says how much one is; ``word`` is what they are called."""

    def __init__(self, word: str, example: str = '1/4096 rev') -> None:
        super().__init__(f'counts need to be told how much one of them is: write {example} in '
                         f'place of {word}, with your own number')
        self.word = word


_ONE = Unit(1.0, (0, 0, 0, 0))
_RAD = _ONE._replace(angle=1)
_PREFIXES = {'n': 1e-9, 'u': 1e-6, 'µ': 1e-6, 'μ': 1e-6, 'm': 1e-3, 'c': 1e-2, 'd': 1e-1,
             'k': 1e3, 'M': 1e6, 'G': 1e9}
_VOLT, _NEWTON = (1, 2, -3, -1), (1, 1, -2, 0)
_PREFIXED = {
    'g': Unit(1e-3, (1, 0, 0, 0)), 'm': Unit(1.0, (0, 1, 0, 0)),
    **dict.fromkeys(('s', 'sec'), Unit(1.0, (0, 0, 1, 0), timed=True)),
    'A': Unit(1.0, (0, 0, 0, 1)), 'V': Unit(1.0, _VOLT), 'N': Unit(1.0, _NEWTON),
    'Nm': Unit(1.0, (1, 2, -2, 0)), 'ohm': Unit(1.0, (1, 2, -3, -2)),
    'H': Unit(1.0, (1, 2, -2, -2)), 'F': Unit(1.0, (-1, -2, 4, 2)), 'W': Unit(1.0, (1, 2, -3, 0)),
    'J': Unit(1.0, (1, 2, -2, 0)), 'Hz': Unit(1.0, (0, 0, -1, 0), timed=True), 'rad': _RAD,
    'deg': _RAD._replace(factor=pi / 180),
    'rpm': Unit(pi / 30, (0, 0, -1, 0), 1, timed=True), 'gf': Unit(9.80665e-3, _NEWTON),
}
_PREFIXED |= {'\u03a9': _PREFIXED['ohm'], '\u2126': _PREFIXED['ohm'], 'Ohm': _PREFIXED['ohm']}
_PLAIN = {
    'rev': _RAD._replace(factor=2 * pi), 'gon': _RAD._replace(factor=pi / 200),
    'arcmin': _RAD._replace(factor=pi / 10800), 'arcsec': _RAD._replace(factor=pi / 648000),
    'min': Unit(60.0, (0, 0, 1, 0), timed=True), 'h': Unit(3600.0, (0, 0, 1, 0), timed=True),
    'days': Unit(86400.0, (0, 0, 1, 0), timed=True),
    'in': Unit(0.0254, (0, 1, 0, 0)), 'ft': Unit(0.3048, (0, 1, 0, 0)),
    'lb': Unit(0.45359237, (1, 0, 0, 0)),
    'oz': Unit(0.028349523125, (1, 0, 0, 0)), 'lbf': Unit(4.4482216152605, _NEWTON),
    'ozf': Unit(0.27801385095, _NEWTON), '%': Unit(1e-2, _ONE.powers),
}
_PLAIN |= {'day': _PLAIN['days'],
           '°': _PREFIXED['deg'], 'Grad': _PREFIXED['deg'],
           'rps': Unit(2 * pi, (0, 0, -1, 0), 1, timed=True),
           'turn': _PLAIN['rev'], 'turns': _PLAIN['rev'], 'r': _PLAIN['rev']}
_SPELLED = {'volt': _PREFIXED['V'], 'amp': _PREFIXED['A'], 'ampere': _PREFIXED['A'],
            'radian': _RAD, 'degree': _PREFIXED['deg'], 'gradian': _PLAIN['gon'],
            'newton': _PREFIXED['N'],
            'meter': _PREFIXED['m'], 'metre': _PREFIXED['m'], 'second': _PREFIXED['s'],
            'millisecond': Unit(1e-3, (0, 0, 1, 0), timed=True),
            'microsecond': Unit(1e-6, (0, 0, 1, 0), timed=True), 'rpm': _PREFIXED['rpm'],
            'upm': _PREFIXED['rpm'], 'umdrehung': _PLAIN['rev'], 'umdrehungen': _PLAIN['rev']}
"""Words in place of symbols, in one or many, in large or small letters."""
_TURNED = {'Hz': Unit(2 * pi, (0, 0, -1, 0), 1, timed=True),
           'min': Unit(30 / pi, (0, 0, 1, 0), -1, timed=True)}
"""Symbols where turns are counted: 1 Hz is a turn each second, 1/min a turn each minute."""
_NEVER_MEGA = ('g', 'm', 's', 'sec', 'A', 'V', 'H', 'F', 'rad', 'deg', 'rpm')
"""Symbols whose M is a misspelled m: no servo has a megaampere."""
_COUNTS = ('counts', 'count', 'cnt', 'cnts', 'ticks', 'tick', 'inc', 'incs', 'increments', 'lsb',
           'pts', 'points', 'inkremente', 'impulse')
LONGEST = 100
"""Characters of a unit: what is longer is text, and takes ever longer to be read as a unit."""
_WHOLE = re.compile(r'\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![A-Za-z°])|[^\s·*./()^]+|\^|[·*]{1,2}|[/()]')


def parsed(text: str, turned: bool = False) -> Unit:
    """
    Return the factor and powers of a unit of at most LONGEST characters; raises UnitError.

    ``turned``: Hz and 1/min count turns, of 2 pi rad; else Hz is 1/s, and 1/min 1/60 of that.
    """
    if len(text) > LONGEST:
        raise UnitError(f'{text[:20] + "..."!r} has {len(text)} characters; a unit has at most '
                        f'{LONGEST}')
    plain = symbols_of(units_in_symbols(text))
    plain = plain.translate(str.maketrans({'²': '2', '³': '3', '⋅': ' '}))
    plain = re.sub(r'\^\s*|\*\*(?=-?\d)', '', plain).replace('/rad/s', '/(rad/s)')
    plain = re.sub(r'(?<=[A-Za-z])-(?=[A-Za-z])', ' ', plain)  # N-m
    plain = re.sub(r'\b(?:U(?=$)|[Uu](?=/(?:min|s)\b))', 'rev', plain)  # as German has it
    words = _WHOLE.findall(plain)
    found, at = _product(text, words, 0, turned)
    if at != len(words) or not words:
        raise UnitError(f'{text!r} is no unit')
    return found


def _product(text: str, words: list[str], at: int, turned: bool) -> tuple[Unit, int]:
    """Read a product up to a closing bracket; a stroke divides by all up to the next stroke."""
    found, sign = _ONE, 1
    while at < len(words) and words[at] != ')':
        word = words[at]
        at += 1
        if word == '/':
            sign = -1
        elif word == '(':
            inner, at = _product(text, words, at, turned)
            if at >= len(words):
                raise UnitError(f'{text!r}: a bracket is not closed')
            found, at = found.times(inner, sign), at + 1
        elif word[0] not in '·*^':
            found = found.times(_symbols(text, word, turned), sign)
            if word.replace('.', '').isdigit():
                sign = 1  # 1/4096 rev: only the number divides
    return found, at


def _symbols(text: str, word: str, turned: bool) -> Unit:
    """Read symbols that may stand without a gap, as in Nms: the fewest, the longest first."""
    found = _joined(word, turned)
    if found is not None:
        return found
    if word.lower() in _COUNTS:
        raise CountsError(word)
    near = get_close_matches(word, [*_PREFIXED, *_PLAIN], 1, 0.6)
    raise UnitError(f'{text!r} is no unit that is known' + (f'; is it {near[0]!r}?' if near
                                                            else ''))


@lru_cache(4096)
def _joined(word: str, turned: bool) -> Unit | None:
    """Return what symbols without a gap mean; None, once for each end of a word, for none."""
    try:
        return Unit(float(word), _ONE.powers)
    except ValueError:
        pass
    for cut in range(len(word), 0, -1):
        first = _symbol(word[:cut], turned)
        if first is not None:
            if cut == len(word):
                return first
            with suppress(UnitError):
                rest = _joined(word[cut:], turned)
                if rest is not None:
                    return first.times(rest)
    return None


def _symbol(word: str, turned: bool) -> Unit | None:
    spoken = word.lower()
    if spoken in _SPELLED or spoken.removesuffix('s') in _SPELLED and len(word) > 3:
        return _SPELLED.get(spoken) or _SPELLED[spoken.removesuffix('s')]
    match = re.fullmatch(r'(\D+?)(-?\d)?', word)
    if not match:
        return None
    name, power = match[1], int(match[2] or 1)
    known = _PREFIXED | _PLAIN | (_TURNED if turned else {})
    for spelled in (name, name.lower()):
        if spelled in known:
            return _ONE.times(known[spelled], power)
        if spelled[:1] in _PREFIXES and spelled[1:] in _PREFIXED:
            if spelled[0] == 'M' and spelled[1:] in _NEVER_MEGA:
                raise UnitError(f'{name!r} has the prefix of a million; is it {"m" + name[1:]!r}?')
            unit = known[spelled[1:]]
            return _ONE.times(unit._replace(factor=unit.factor * _PREFIXES[spelled[0]]), power)
        if name[:1] in _PREFIXES and len(name) > 3:
            continue
        break
    return None
