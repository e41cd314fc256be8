"""What was probably meant by a name that is not there; servo_twin has its own, by the wall."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def or_what(name: object, known: Iterable[object], listing: str = 'there are') -> str:
    """Return "did you mean 'x'? there are [...]" for a name that is none of ``known``."""
    names = [str(one) for one in known]
    near = get_close_matches(str(name), names, 1, 0.6)
    return (f'did you mean {near[0]!r}? ' if near else '') + f'{listing} {names}'
