"""Parts of a message, whatever its encoding made of it: an object or a dictionary."""

from __future__ import annotations

from typing import Any

LACKING = object()


def fields_in(at: Any) -> list[str]:
    """Return the names of the fields of a message or a part of it."""
    if isinstance(at, dict):
        return list(at)
    if hasattr(at, 'DESCRIPTOR'):
        return [one.name for one in at.DESCRIPTOR.fields]
    return [name for name in getattr(at, '__dataclass_fields__', {}) if name != '__msgtype__']


def part_of(at: Any, name: str, otherwise: Any = LACKING) -> Any:
    """Return a field of a message or a part of it, ``otherwise`` where there is none."""
    if isinstance(at, dict):
        return at.get(name, otherwise)
    return getattr(at, name, otherwise) if name in fields_in(at) else otherwise
