"""
One number of a message, named as the mapping files of `servo-identify import` name it.

A source is ``TOPIC.field``, ``TOPIC.field.field`` or ``TOPIC.field[index]``. The index is a name
that the message lists in ``name``, ``joint_names`` or ``interface_names``, else a number:
``/joint_states.position[elbow]``.
"""

from __future__ import annotations

from math import nan
import re
from typing import Any

_NAMES = ('name', 'names', 'joint_names', 'interface_names')
_PART = re.compile(r'(\w+)|\[([^\]]+)\]|\.')
STAMP = 'stamp'
"""The field that means the time of a message."""


class FieldError(ValueError):
    """A source that is written wrong, or that a message does not have."""


def stamp_of(message: Any) -> int:
    """Return the stamp of a message in ns: of its header, or its own; 0 where it has none."""
    stamp = getattr(getattr(message, 'header', message), STAMP, None)
    return stamp.sec * 10**9 + stamp.nanosec if hasattr(stamp, 'nanosec') else 0


class OtherName(FieldError):
    """A number in a source at which another name stands than before."""


class Field:
    """The number that ``source`` names; raises FieldError for a source without topic or field."""

    def __init__(self, source: str) -> None:
        self.source = source
        self._names: dict[int, str] = {}  # what stood at a number first, by the depth of its list
        self.topic, _, rest = source.partition('.')
        self.parts = [m[1] or m[2] for m in _PART.finditer(rest) if m[1] or m[2]]
        if not self.topic or not self.parts:
            raise FieldError(f'{source!r} names no field of a topic; write TOPIC.field or '
                             'TOPIC.field[index], such as /joint_states.position[elbow]')

    def of(self, message: Any) -> float:
        """
        Return the number in a message, NaN where the message leaves its row empty.

        Raises FieldError when the message has no such field or name, or the name twice; the error
        says what it has. So does a point of a trajectory that is due later than its message, and
        a number at which another name stands than before, as OtherName.
        """
        at, seen = message, [message]
        for part in self.parts:
            if hasattr(at, '__len__') and not isinstance(at, str):
                at = self._element(at, part, seen)
            elif hasattr(at, part):
                at = getattr(at, part)
            else:
                known = getattr(at, 'get_fields_and_field_types', dict)()
                raise FieldError(f'{self.source}: there is no {part!r}; there are {list(known)}')
            seen.append(at)
            self._is_due(at)
        try:
            return float(at)
        except (TypeError, ValueError):
            raise FieldError(f'{self.source} is no number; give a field or an index of '
                             f'{type(at).__name__}') from None

    def _is_due(self, at: Any) -> None:
        ahead = getattr(at, 'time_from_start', None)
        if ahead is not None and (ahead.sec or ahead.nanosec):
            raise FieldError(f'{self.source} is a plan: its point is due '
                             f'{ahead.sec + ahead.nanosec * 1e-9:g} s after the message; take '
                             "'reference' of the controller's state topic")

    def _element(self, row: Any, which: str, seen: list[Any]) -> Any:
        lists = [list(names) for owner in reversed(seen) for key in _NAMES
                 if (names := getattr(owner, key, ())) and not isinstance(names, str)]
        index = next((names.index(which) for names in lists if which in names), None)
        if index is None and not which.isdigit():
            names = sum(lists, [])
            raise FieldError(f'{self.source}: there is no {which!r}; ' + (
                f'names are {names}' if names else 'the message lists no names: write a number '
                f'in place of {which!r}, 0 for the first'))
        if any(names.count(which) > 1 for names in lists):
            raise FieldError(f'{self.source}: there are two {which!r} in one message; names are '
                             f'{sum(lists, [])}')
        if index is None:
            index = int(which)
            named = [names[index] for names in lists if index < len(names) == len(row)]
            self._stays(len(seen), which, named[0] if named else None)
        return row[index] if index < len(row) else nan

    def _stays(self, depth: int, which: str, name: str | None) -> None:
        """Raise OtherName where a number has come to mean another name."""
        first = self._names.setdefault(depth, name) if name is not None else None
        if first != name:
            raise OtherName(f'{self.source}: number {which} was {first!r} at first, and is '
                             f'{name!r} by now; write the name in place of the number')
