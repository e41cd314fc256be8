"""Names, numbers and units as the page says them."""

from __future__ import annotations

from collections.abc import Callable
from math import floor, isfinite, log10
import re
from typing import TypeGuard

from markupsafe import escape, Markup

MISSING = '–'
_SHORTENED = re.compile(r'(rad|N|A|V|m|W|Hz|J)(?![A-Za-z%])')
_FLAG = re.compile(r'(--[a-z][a-z-]*[a-z])')
_TOGETHER = re.compile(r'(?<=\d) (?=%|\+- )|(?<=\+-) (?=\d)')
_PREFIXES = ((1e-3, 'm'), (1e-6, 'µ'), (1e-9, 'n'))
_RAISED = str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹')


def spoken(name: object) -> str:
    """Return a name of a file, an effect or a channel as words."""
    return str(name or '').replace('_', ' ').replace(':', ': ').replace(':  ', ': ')


def unbroken(text: object) -> Markup:
    """Return a sentence as HTML in which no option such as --refit, 90 % or 4 +- 1 breaks."""
    parts = _FLAG.split(_TOGETHER.sub('\N{NO-BREAK SPACE}', str(text)))
    return Markup('').join(Markup('<code>{}</code>').format(part) if k % 2 else escape(part)
                           for k, part in enumerate(parts))


def known(value: object) -> TypeGuard[float]:
    """Say whether a value is a number that can be shown."""
    return (isinstance(value, (int, float)) and not isinstance(value, bool)
            and isfinite(value))


def number(value: object, digits: int = 4) -> str:
    """Return a number with so many digits; a dash where there is none."""
    if not known(value):
        return MISSING
    if value == 0:
        return '0'
    power = floor(log10(abs(float(f'{value:.{digits - 1}e}'))))
    if -3 <= power < 5:
        text = f'{value:.{max(0, digits - 1 - power)}f}'
        text = text.rstrip('0').rstrip('.') if '.' in text else text
    else:
        text = f'{value / 10.0**power:.{digits - 1}f}'.rstrip('0').rstrip('.')
        text += f' × 10{str(power).translate(_RAISED)}'
    return text.replace('-', '−')


def unit(text: object) -> str:
    """Return a unit with its powers raised: kg m2 is kg m²."""
    return re.sub(r'(?<=[A-Za-z])([23])\b', lambda found: found[1].translate(_RAISED),
                  str(text or ''))


def percent(share: object, digits: int = 2) -> str:
    """Return a share as per cent; what is not quite all is not rounded to 100 %."""
    if not known(share):
        return MISSING
    if digits == 2 and 0.995 <= share < 1.0:
        return '> 99 %'
    return f'{number(100.0 * share, digits)} %'


def ratio(value: object) -> str:
    """Return a residual over its noise; one that is next to nothing is said to be small."""
    return '< 0.01' if known(value) and 0.0 < value < 0.01 else number(value, 3)


def shortened(text: object, largest: float) -> tuple[float, str]:
    """Return the factor and the unit (mrad, N m) in which a largest value reads well."""
    name = unit(text)
    if not 0.0 < largest < 0.02 or not _SHORTENED.match(name):
        return 1.0, name
    return next(((factor, prefix + name) for factor, prefix in _PREFIXES
                 if largest >= 0.2 * factor), (1.0, name))


def between(interval: object, said: Callable[[object], str] = percent) -> str:
    """Return an interval as words; nothing where one of its ends is missing."""
    if not isinstance(interval, (list, tuple)) or len(interval) != 2:
        return ''
    if not all(known(end) for end in interval):
        return ''
    low, high = (said(end) for end in interval)
    if low.endswith(' %') and high.endswith(' %'):
        low = low.removesuffix(' %')
    return f'{low} to {high}'
