"""How sure values of effects are by the equations: read off amplitudes that are drawn again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from servo_twin.physics.servo import Placed, Servo, Value

from ..mechanisms.hypothesis import Hypothesis
from .curves import Part
from .laws import Formed
from .with_values import with_values

ROUNDING = 1e-12  # share of a value by which it differs from itself


def stds_of(part: Part, read: Callable[[Part], Mapping[str, Value]]) -> dict[str, float]:
    """
    Return the standard deviations of values, by name, that ``read(part)`` has from amplitudes.

    Values by path. Those that hang on no amplitude have none.
    """
    if part.draws is None or part.draws.shape[1:] != part.amplitudes.shape:
        return {}
    drawn = [read(replace(part, amplitudes=each)) for each in part.draws]
    found: dict[str, float] = {}
    for path, first in drawn[0].items():
        several = [np.atleast_1d(one[path]) for one in drawn if path in one]
        if len({len(one) for one in several}) > 1:
            continue
        names = [f'{path}[{k}]' for k in range(len(several[0]))] if isinstance(
            first, tuple) else [path]
        size = ROUNDING * np.abs(several).max(axis=0)
        found |= {name: float(std) for name, std, least in zip(
            names, np.std(several, axis=0), size, strict=True) if std > least}
    return found


def by_path(placed: Sequence[Placed], several: Sequence[Formed | None]) -> dict[str, Value]:
    """Return the values of effects by path."""
    return {path: value for at, one in zip(placed, several, strict=False) if one is not None
            for path, value in at.paths(one.values).items()}


def with_others(part: Part, one: Hypothesis, servo: Servo,
                 placed: Sequence[Placed]) -> dict[str, Value]:
    """Return the values of effects that come with others of the file, all by path."""
    both = with_values(part, one, servo)
    assert both is not None  # it depends on the kind of the part alone
    return by_path(placed, both[0]) | {path: servo.numbers[path] + change
                                      for path, change in both[1].items()}
