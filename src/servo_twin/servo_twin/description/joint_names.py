"""Several joints as flags name them, and the files of each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
import re

from .nearest_name import or_what

ALL = 'all'


def names_in(flags: Sequence[str]) -> list[str]:
    """Return the joints that --joint names: elbow,knee or one each time."""
    return [*dict.fromkeys(name for text in flags for one in text.split(',')
                           if (name := one.strip()))]


def are_several(flags: Sequence[str]) -> bool:
    """Tell whether --joint names several joints."""
    names = names_in(flags)
    return len(names) > 1 or names == [ALL]


def file_names(joints: Sequence[str]) -> dict[str, str]:
    """Return a name for the files of each joint, without signs that a path cannot hold."""
    plain = {one: re.sub(r'\W+', '_', one).strip('_') or 'joint' for one in joints}
    plain = {one: f'joint_{name}' if name[0].isdigit() else name for one, name in plain.items()}
    count = Counter(plain.values())
    return {one: name if count[name] == 1 else f'{name}_{number}'
            for number, (one, name) in enumerate(plain.items(), 1)}


def value_of(flag: str, texts: Sequence[str], joint: str, joints: Sequence[str]) -> str | None:
    """
    Return the text of a value for a joint, None where there is none.

    A value is for all joints, or behind ``elbow=`` for one; of several the last counts. Raises
    ValueError for a joint that is not among them.
    """
    found: dict[str, str] = {}
    for text in texts:
        who, equals, value = text.partition('=')
        if equals and who not in joints:
            raise ValueError(f'{flag} {text!r}: there is no joint {who!r} here; '
                             f'{or_what(who, joints, "there are")}')
        found[who if equals else ''] = value if equals else text
    return found.get(joint, found.get(''))
