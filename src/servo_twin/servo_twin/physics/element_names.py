"""Names of single numbers of a servo: the path of a value, or an element of a row, `path[i]`."""

from __future__ import annotations

import re

_ELEMENT = re.compile(r'^(?P<path>.+)\[(?P<index>\d+)\]$')


def split_name(name: str) -> tuple[str, int | None]:
    """Return the path of a name and the place in its row; None where the name is a path."""
    match = _ELEMENT.match(name)
    return (match['path'], int(match['index'])) if match else (name, None)
