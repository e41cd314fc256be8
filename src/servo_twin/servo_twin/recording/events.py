"""What happened beside the samples; what changed in a twin, by the first sample it acts on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import json

from ..physics.servo import Value

PARAMETERS, SERVO_FILE = 'parameters', 'servo_file'


@dataclass(frozen=True)
class Change:
    """One change of ``kind``, from sample ``sequence`` on; ``content`` as of Event.msg."""

    sequence: int
    kind: str
    content: str

    @property
    def values(self) -> dict[str, Value]:
        """The values by path of a change of parameters."""
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


def written(values: Mapping[str, Value]) -> str:
    """Return values by path as the content of a change; floats come back to the last bit."""
    return json.dumps(dict(values))
