"""Files with and without some effects, each simulated once over the recordings that judge it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from servo_twin.physics.servo import Servo, ServoError, Value
from servo_twin.recording.recording import Recording

from ...fit.estimate import Estimate
from ..decisions import PRACTICAL, WORTH
from .added import Added, servo_with
from .cut import Cut
from .gap import Gap, shrink_interval
from .simulated_gap import Diverged, simulated


@dataclass(frozen=True)
class Trial:
    """
    The recordings that effects are fitted to, and those on which they are accepted.

    ``known`` holds the gaps of the files that were simulated already, ``cut`` the recordings in
    horizons.
    """

    fitting: Sequence[Recording]
    accepting: Sequence[Recording]
    known: dict[tuple[object, ...], Gap | None] = field(default_factory=dict)
    cut: Cut = field(default_factory=Cut)

    def of(self, base: Servo, added: tuple[Added, ...] = (),
           estimate: Estimate | None = None) -> Tried | None:
        """Return effects in a file, simulated; None where that cannot be."""
        gap = self.gap(built(base, added))
        return None if gap is None else Tried(self, base, added, gap, estimate)

    def without(self, whole: Tried, number: int) -> Tried | None:
        """Return some effects without one of them, simulated; None where that cannot be."""
        added = left_out(whole.added, number)
        rest, all_ = built(whole.base, added), built(whole.base, whole.added)
        gap = self.gap(rest and all_ and as_in(rest, all_))
        return None if gap is None else Tried(self, whole.base, added, gap, None)

    def gap(self, servo: Servo | None) -> Gap | None:
        """Return the gap of a file on the accept recordings; None where it cannot run."""
        return self._gap(servo, self.accepting)

    def fitted(self, servo: Servo | None) -> Gap | None:
        """Return the gap of a file where it is fitted; None where it cannot run."""
        return self._gap(servo, self.fitting)

    def with_added(self, servo: Servo, one: Added) -> Gap | None:
        """Return the gap of a file with an effect where it is fitted; None where it cannot run."""
        return self.fitted(built(servo, (one,)))

    def misfit(self, servo: Servo) -> float:
        """Return the gap of a file where it is fitted as one number; infinite: it cannot run."""
        gap = self.fitted(servo)
        return np.inf if gap is None else gap.total()

    def _gap(self, servo: Servo | None, recordings: Sequence[Recording]) -> Gap | None:
        if servo is None:
            return None
        key = (recordings is self.fitting, content(servo))
        if key not in self.known:
            try:
                self.known[key] = simulated(servo, recordings, self.cut).gap
            except (Diverged, ServoError, np.linalg.LinAlgError):
                self.known[key] = None
        return self.known[key]


@dataclass(frozen=True)
class Tried:
    """
    Effects at some values in a file: their gap on the accept recordings, the fit behind them.

    Without effects it is the file by itself.
    """

    trial: Trial
    base: Servo
    added: tuple[Added, ...]
    gap: Gap
    estimate: Estimate | None

    @property
    def total(self) -> float:
        """The gap on the accept recordings as one number."""
        return self.gap.total()

    @cached_property
    def fitted(self) -> Gap | None:
        """The gap on the recordings of the fit."""
        return self.trial.fitted(built(self.base, self.added))


def alike(before: Tried, after: Tried) -> bool:
    """
    Tell whether effects bring the simulation nearer where they were fitted, and harm nowhere.

    On a short accept recording a right effect may gain nothing; that is no ground against it. It
    is one where the 90 % interval of its gain lies below zero, and what is left then matters.
    """
    return (after.fitted is not None and before.fitted is not None
            and after.fitted.total() < before.fitted.total()
            and (after.total <= PRACTICAL or shrink_interval(before.gap, after.gap)[1] > 0.0))


def everywhere(before: Tried, after: Tried) -> bool:
    """Tell whether the gaps are smaller by what is worth naming, and larger in no recording."""
    return all(_nearer(*pair) for pair in ((before.gap, after.gap), (before.fitted, after.fitted)))


def _nearer(before: Gap | None, after: Gap | None) -> bool:
    if before is None or after is None or after.total() > (1.0 - WORTH) * before.total():
        return False
    several = [np.flatnonzero(before.recording == n) for n in np.unique(before.recording)]
    return all(after.total(blocks) <= before.total(blocks) for blocks in several)


def left_out(added: tuple[Added, ...], number: int) -> tuple[Added, ...]:
    """Return effects without one of them."""
    return (*added[:number], *added[number + 1:])


def built(servo: Servo, added: Sequence[Added]) -> Servo | None:
    """Return the servo with some effects; None where one needs another that is not there."""
    try:
        return servo_with(servo, added)
    except ServoError:
        return None


def as_in(servo: Servo, whole: Servo) -> Servo:
    """
    Return a servo as one with more effects, these off: it needs no compiled step of its own.

    Where it is no part of that, as it is.
    """
    more = [placed for placed in whole.effects if placed not in servo.effects]
    if not more or not set(servo.effects) < set(whole.effects) or (
            servo.mechanism, servo.step) != (whole.mechanism, whole.step):
        return servo
    off: dict[str, Value] = {}
    for placed in more:
        for name in placed.effect.amplitudes():
            path = f'effects.{placed.name}.{name}'
            value, none = whole.values[path], placed.effect.parameters[name].off or 0.0
            off[path] = (none,) * len(value) if isinstance(value, tuple) else none
    return replace(whole, values={**whole.values, **servo.values, **off})


def content(servo: Servo) -> tuple[object, ...]:
    """Return what tells the simulation of a file from those of the others of one diagnosis."""
    return servo.mechanism, servo.effects, servo.step, servo.theta.tobytes()
