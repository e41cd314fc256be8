"""What changed in a twin while it ran, and what else happened beside the samples."""

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
class Happening:
    """What a node told beside the samples: at ``time``, s since 1970, in one sentence."""

    time: float
    source: str
    kind: str
    text: str


def written(values: Mapping[str, Value]) -> str:
    """Return values by path as the content of a change; floats come back to the last bit."""
    return json.dumps(dict(values))
