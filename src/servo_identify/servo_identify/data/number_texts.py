"""Numbers as programs write them: a typesetter's minus, 1.5D+00, or 1,016.807 of a spreadsheet."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import re
from typing import Any

MINUS = '\N{MINUS SIGN}'  # which some programs write in place of a hyphen
_BASE_16 = re.compile('[0-9A-Fa-f]{1,16}|')
_FORTRAN = re.compile(r'(?<=[\d.])[dD](?=[-+]?\d+$)')
_BOTH = re.compile(r"[-+]?\d{1,3}(?:([.,'\u2019 ])\d{3})(?:\1\d{3})*(?!\1)([.,])\d+")


def is_hexadecimal(cells: Iterable[str]) -> bool:
    """Tell whether all texts may be numbers to base 16; an empty one may."""
    return all(_BASE_16.fullmatch(cell) for cell in cells)


def is_number(text: str) -> bool:
    """Tell whether a text is a number, with a decimal point or a comma."""
    try:
        float(plain(text.strip().strip('"').replace(',', '.')))
    except ValueError:
        return False
    return True


def plain(text: str) -> str:
    """Return a number as Python reads it: a typesetter's minus, 1.5D+00 of Fortran."""
    return _FORTRAN.sub('E', text.replace(MINUS, '-'))


def without_groups(values: Sequence[Any]) -> Sequence[Any]:
    """
    Return texts of numbers without signs between their thousands, and with a decimal point.

    A number that has both signs says which is which. Where numbers contradict it, or none has
    both, all stay as they are: 1,016 alone may be either.
    """
    told = {match.groups() for one in values if isinstance(one, str)
            and (match := _BOTH.fullmatch(one.strip()))}
    if len(told) != 1:
        return values
    (group, decimal), = told
    one = re.escape(group)
    number = re.compile(rf'[-+]?(?:\d{{1,3}}(?:{one}\d{{3}})+|\d+)(?:{re.escape(decimal)}\d+)?')
    texts = [value.strip() for value in values if isinstance(value, str)]
    if not all(number.fullmatch(text) for text in texts):
        return values
    return [value.strip().replace(group, '').replace(decimal, '.') if isinstance(value, str)
            else value for value in values]
