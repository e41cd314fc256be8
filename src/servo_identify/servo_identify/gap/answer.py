"""What a diagnosis answers: an object with names, printable, saved as report.json."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
import json
from pathlib import Path


@dataclass(frozen=True)
class Located:
    """How far one balance is off."""

    balance: str
    share: float
    gap_to_noise: float
    interval: tuple[float, float]
    verdict: str


@dataclass(frozen=True)
class Cause:
    """An accepted effect: its values, what it shrinks, what it cannot be told from."""

    effect: str
    site: str
    parameters: dict[str, dict]
    shrink_predicted: float
    shrink_realised: float
    interval: tuple[float, float]
    ambiguous_with: tuple[str, ...]


@dataclass(frozen=True)
class GapReport:
    """
    The answer of a diagnosis, in the form that DESIGN.md fixes for report.json.

    ``by_family`` and ``waterfall`` are what the page shows beside it.
    """

    servo: str
    recordings: dict[str, list[str]]
    channels: dict[str, dict]
    where: tuple[Located, ...]
    which: tuple[Cause, ...]
    verdict: dict
    gap: dict
    unknown: dict
    next_experiment: dict
    warnings: tuple[str, ...]
    by_family: dict = field(default_factory=dict)
    waterfall: list = field(default_factory=list)
    timing: dict = field(default_factory=dict)

    def as_dict(self) -> dict:
        """Return the report as plain numbers, lists and dictionaries."""
        tree = {'schema': 'servo_gap/1', **asdict(self)}
        tree['where'] = [asdict(one) for one in self.where]
        tree['which'] = [asdict(one) for one in self.which]
        return _plain(tree)

    def save(self, path: str | Path) -> None:
        """Write report.json."""
        Path(path).write_text(json.dumps(self.as_dict(), indent=1, allow_nan=False) + '\n')

    def __str__(self) -> str:
        return self.verdict['sentence']


def _plain(thing):
    if isinstance(thing, dict):
        return {str(k): _plain(v) for k, v in thing.items()}
    if isinstance(thing, (list, tuple)):
        return [_plain(v) for v in thing]
    if isinstance(thing, (bool, str, int)) or thing is None:
        return thing
    number = float(thing)
    return number if number == number and abs(number) != float('inf') else None
