"""What was probably meant by a name that is not there: one sentence for every error."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

MOST = 40  # names that are listed whole


def or_what(name: object, known: Iterable[object], listing: str = 'there are') -> str:
    """
    Return "did you mean 'x'? there are [...]" for a name that is none of ``known``.

    Without anything near, the list stands alone; of a long list its beginning.
    """
    names = [str(one) for one in known]
    lower = {one.lower(): one for one in reversed(names)}
    near = [lower[one] for one in get_close_matches(str(name).lower(), lower, 1, 0.6)]
    if not near and len(str(name)) > 2:
        near = [one for one in names if str(name).lower() in one.lower()][:1]
    more = f' and {len(names) - MOST} more' if len(names) > MOST else ''
    return (f'did you mean {near[0]!r}? ' if near else '') + f'{listing} {names[:MOST]}{more}'
