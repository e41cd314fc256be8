"""What a diagnosis answers: objects with names, printable, saved as report.json (servo_gap/2)."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
import json
from pathlib import Path
from typing import Any

from servo_twin.description.whole_file import write_whole

SCHEMA = 'servo_gap/2'
RUNGS = ('place', 'mechanism', 'curve', 'law')


@dataclass(frozen=True)
class Located:
    """
    How far one equation is off: ``share`` of the whole gap, residual over noise and margin.

    ``by_recording`` has the same of each recording that was searched, by its name.
    """

    balance: str
    share: float
    gap_to_noise: float
    interval: tuple[float, float]
    verdict: str
    by_recording: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Alternative:
    """Another explanation: its confidence, and what would tell it from the named one."""

    effect: str
    site: str
    confidence: float
    tell: str


@dataclass(frozen=True)
class MissingEffect:
    """
    A missing effect, as far down the ladder as the evidence goes.

    ``rung`` is the lowest that holds; ``confidence`` that of each rung, 0 to 1; ``law`` whether
    the formula of the catalogue lies within the band of the curve; ``curve`` x, y and band with
    their units, or None; shrinks are shares of the gap of the file as given that come back when
    this effect alone is taken out again, on the accept and on the report recordings. ``added`` is
    the wave behind the controller (shape, period s, amplitude and offset V), where one was found;
    ``named_in`` the share of the halves of the recordings that name the effect. ``simulated`` is
    false of what no simulation of the twin shows: then the shrinks are those of its equation.
    """

    effect: str
    site: str
    parameters: dict[str, dict[str, Any]]
    shrink_predicted: float
    shrink_realised: float
    interval: tuple[float, float]
    ambiguous_with: tuple[str, ...]
    rung: str
    confidence: dict[str, float]
    mechanism: dict[str, Any]
    law: bool
    curve: dict[str, Any] | None
    alternatives: tuple[Alternative, ...]
    change: str
    added: dict[str, Any] | None = None
    named_in: float = 1.0
    simulated: bool = True


@dataclass(frozen=True)
class GapReport:
    """The answer of a diagnosis, in the form that DESIGN.md fixes for report.json."""

    servo: str
    recordings: dict[str, list[str]]
    channels: dict[str, dict[str, Any]]
    where: tuple[Located, ...]
    which: tuple[MissingEffect, ...]
    verdict: dict[str, Any]
    gap: dict[str, Any]
    unknown: dict[str, Any]
    next_experiment: dict[str, Any]
    warnings: tuple[str, ...]
    moved: tuple[dict[str, Any], ...] = ()
    defaults: tuple[dict[str, Any], ...] = ()
    stability: dict[str, Any] = field(default_factory=dict)
    equations: dict[str, Any] = field(default_factory=dict)
    findings: tuple[dict[str, Any], ...] = ()
    confirm: tuple[str, ...] = ()
    timing: dict[str, Any] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return the report as plain numbers, lists and dictionaries."""
        return _plain({'schema': SCHEMA, **asdict(self)})

    def save(self, path: str | Path) -> None:
        """Write report.json."""
        write_whole(path, json.dumps(self.as_dict(), indent=1, allow_nan=False) + '\n')

    def __str__(self) -> str:
        return self.verdict['sentence']


def _plain(thing: Any) -> Any:
    if isinstance(thing, dict):
        return {str(k): _plain(v) for k, v in thing.items()}
    if isinstance(thing, list | tuple):
        return [_plain(v) for v in thing]
    if hasattr(thing, 'tolist'):
        return _plain(thing.tolist())
    if isinstance(thing, bool | str | int) or thing is None:
        return thing
    number = float(thing)
    return number if number == number and abs(number) != float('inf') else None
