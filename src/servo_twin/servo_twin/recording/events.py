"""What happened beside the samples; what changed in a twin, by the first sample it acts on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import json
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..physics.servo import Value

BEGAN, PARAMETERS, SERVO_FILE, SETTINGS = 'began', 'parameters', 'servo_file', 'settings'
CHANGES = (BEGAN, PARAMETERS, SERVO_FILE, SETTINGS)
"""The kinds that a replay obeys."""

ZERO = 'zero'
"""Of a beginning: the instant of sample number 0, ns, which tells one driver from the next."""
SAME = 500_000_000
"""ns by which the samples number 0 of two drivers are further apart: one takes longer to start."""


@dataclass(frozen=True)
class Change:
    """One change of ``kind``, from sample ``sequence`` on; ``content`` as of Event.msg."""

    sequence: int
    kind: str
    content: str

    @property
    def values(self) -> dict[str, Value]:
        """The values by path of a change of parameters; fields by name of the other kinds."""
        return {path: tuple(value) if isinstance(value, list) else value
                for path, value in json.loads(self.content).items()}

@dataclass(frozen=True)
class Happened:
    """One event as of Event.msg; ``stamp`` is in ns."""

    stamp: int
    source: str
    kind: str
    text: str
    sequence: int = 0
    content: str = ''

    @property
    def time(self) -> float:
        """Seconds since 1970."""
        return self.stamp * 1e-9

    @property
    def servo_file(self) -> str:
        """The servo file that a twin runs from here on; empty where it goes on with its own."""
        if self.kind != BEGAN:
            return self.content if self.kind == SERVO_FILE else ''
        try:
            return str(json.loads(self.content)['servo_file'])
        except (ValueError, LookupError, TypeError):  # not of a twin of ours
            return ''

def written(values: Mapping[str, Value]) -> str:
    """Return values by path as the content of a change; floats come back to the last bit."""
    return json.dumps(dict(values))

def obeyed(changes: Sequence[Change]) -> list[Change]:
    """
    Return the changes that a replay obeys, in their order.

    What was set before a twin had answered any sample stands in the servo with which it began. A
    twin that was started again counts from 0 once more, so that such a change names no instant.
    """
    last = max((k for k, one in enumerate(changes) if one.kind == BEGAN), default=-1)
    return [one for k, one in enumerate(changes) if one.sequence or k > last or one.kind == BEGAN]

def beside(changes: Sequence[Change], zero: int) -> list[Change]:
    """
    Return the changes beside the driver whose sample number 0 was taken at ``zero``, ns.

    Another driver counts from 0 again, so that a number alone names no sample. What a twin of an
    earlier version told does not say beside which driver it was, and is returned.
    """
    found, own = [], True
    for one in changes:
        if one.kind == BEGAN:
            told = one.values.get(ZERO)
            own = not isinstance(told, int) or abs(told - zero) < SAME
        if own:
            found.append(one)
    return found

def as_for_another(changes: Sequence[Change]) -> list[Change]:
    """Return the changes as they act on another servo, whose values stay as they are."""
    return [_with(one, servo_file='') if one.kind == BEGAN else one
            for one in changes if one.kind in (BEGAN, SETTINGS)]

def with_mode(changes: Sequence[Change], mode: str) -> list[Change]:
    """Return the changes as they act on a twin that runs in one mode all the time."""
    return [_with(one, mode=mode) if one.kind in (BEGAN, SETTINGS) else one for one in changes]

def _with(change: Change, **fields: str) -> Change:
    return replace(change, content=json.dumps({**change.values, **fields}))
