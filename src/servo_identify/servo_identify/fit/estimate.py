"""What a fit found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
import json
from pathlib import Path
from typing import Any

import numpy as np

from servo_twin.bag import OpenRecording
from servo_twin.description.whole_file import write_whole
from servo_twin.physics.element_names import split_name
from servo_twin.physics.servo import Provenance, Servo
from servo_twin.recording.recording import COLUMNS, Recording


@dataclass(frozen=True)
class Estimate:
    """
    Values, how sure they are, and what to know before using them.

    ``names`` of the free numbers in order; ``values``, ``std`` (NaN: not identified) and
    ``units`` by name; ``std_within`` the same with what the tolerances of the servo file know
    counted in; ``correlation`` (n, n); ``rms`` the residual of each channel in its unit
    over all recordings, ``rms_before`` the same at the values to start from, ``noise`` its floor;
    ``delays`` seconds by which each channel is late, with ``delay_std``; ``cost`` half the
    weighted sum of squares, ``cost_before`` likewise with the same weights; ``servo`` has the new
    values, each with its standard error and bags.
    """

    servo: Servo
    names: tuple[str, ...]
    values: Mapping[str, float]
    std: Mapping[str, float]
    units: Mapping[str, str]
    correlation: np.ndarray
    warnings: tuple[str, ...]
    rms: Mapping[str, float]
    rms_before: Mapping[str, float]
    noise: Mapping[str, float]
    cost: float
    cost_before: float
    delays: Mapping[str, float]
    delay_std: Mapping[str, float]
    mode: str
    horizon: float
    iterations: int
    seconds: float
    bags: tuple[str, ...] = field(default=())
    std_within: Mapping[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return everything but the servo, ready for JSON; NaN becomes null."""
        plain = {name: getattr(self, name) for name in self.__dataclass_fields__
                 if name != 'servo'}
        plain['correlation'] = self.correlation.tolist()
        found: dict[str, Any] = _nulled(plain)
        return found

    def save(self, path: str | Path) -> None:
        """Write the estimate as JSON."""
        write_whole(path, json.dumps(self.as_dict(), indent=1) + '\n')

    def __str__(self) -> str:
        width = max(map(len, self.names))
        lines = [f'{n:{width}}  {self.values[n]: .6g} ± {self.std[n]:.2g} {self.units[n]}'.rstrip()
                 for n in self.names]
        return '\n'.join([*lines, *self.by_channel(), *(f'warning: {w}' for w in self.warnings)])

    def by_channel(self) -> list[str]:
        """Return what the fit found of each channel, as lines: its residual (RMS), its delay."""
        units = {c: self.servo.reads(COLUMNS[c], c) for c in self.rms}
        residuals = [f'{c}: residual {self.rms_before[c]:.4g} -> {self.rms[c]:.4g} {units[c]}, '
                     f'noise {self.noise[c]:.3g} {units[c]}' for c in self.rms]
        return residuals + [f'{c} is late by {1e3 * d:.3f} ± {1e3 * self.delay_std[c]:.3f} ms'
                            for c, d in self.delays.items()]


def servo_with(servo: Servo, names: tuple[str, ...], values: Mapping[str, float],
               std: Mapping[str, float], bags: tuple[str, ...], source: str) -> Servo:
    """Return the servo with fitted values; a row's standard error is its largest."""
    errors: dict[str, list[float]] = {}
    for name in names:
        errors.setdefault(split_name(name)[0], []).append(std[name])
    provenance = dict(servo.provenance)
    for path, several in errors.items():
        worst = max((e for e in several if np.isfinite(e)), default=None)
        provenance[path] = Provenance(source, worst, bags)
    return replace(servo.with_values({name: values[name] for name in names}),
                   provenance=provenance)


def bag_name(recording: Recording | OpenRecording) -> str:
    """Return how provenance names a recording: its name and the first of its hash."""
    digest = recording.digest
    return f'{recording.name}#{digest[:12]}' if digest else recording.name


def _nulled(thing: Any) -> Any:
    if isinstance(thing, Mapping):
        return {k: _nulled(v) for k, v in thing.items()}
    if isinstance(thing, (list, tuple)):
        return [_nulled(v) for v in thing]
    if isinstance(thing, float) and not np.isfinite(thing):
        return None
    return thing
