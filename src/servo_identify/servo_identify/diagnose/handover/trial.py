"""Files with and without some effects, each simulated once over the recordings that judge it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from operator import or_

import numpy as np

from servo_twin.physics.servo import Servo, ServoError, Value
from servo_twin.recording.recording import Recording

from ...fit.estimate import Estimate
from ..decisions import PRACTICAL, WORTH
from .added import Added, servo_with
from .certainty import spread
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


def vanished(best: Tried, begun: Sequence[Added]) -> int | None:
    """
    Return which effect a fit leaves nothing of, or a value of the file that it leaves, if one.

    ``begun`` are the effects as the equations have them. Nothing is a share of that, or of the
    value, that matters to nobody, or what is within one standard deviation and does nothing. A
    level beside one that fades is unsure, and the simulation may need it all the same.
    """
    were = {id(one.part): one.values for one in begun}
    for number, one in enumerate(best.added):
        if one.placed:
            known: dict[str, Value] = {
                f'effects.{placed.name}.{name}': placed.effect.parameters[name].off or 0.0
                for placed in one.placed for name in placed.effect.amplitudes()}
            scale = were.get(id(one.part), {})
        else:
            known = scale = {path: best.base.values[path] for path in one.values
                             if path in best.base.values}
        now = [np.atleast_1d(np.abs(np.subtract(one.values.get(path, off), off)))
               for path, off in known.items()]
        least = [np.abs(scale.get(path, 0.0)) for path in known]
        sure = [_std(best.estimate, one, begun, path) if len(size) == 1 else 0.0
                for path, size in zip(known, now, strict=True)]  # a curve's make up for each other
        small = [np.max(size) <= PRACTICAL * np.max(most)
                 for size, most in zip(now, least, strict=True)]
        unsure = [np.max(size) <= std for size, std in zip(now, sure, strict=True)]
        if now and (all(small) or (
                all(map(or_, small, unsure)) and _does_nothing(best, number))):
            return number
    return None


def _does_nothing(best: Tried, number: int) -> bool:
    """Tell whether a simulation without one of some effects is as near to the rig."""
    rest = best.trial.of(best.base, left_out(best.added, number))
    return rest is not None and (1.0 - WORTH) * rest.total <= best.total


def _std(estimate: Estimate | None, one: Added, begun: Sequence[Added], path: str) -> float:
    """
    Return the standard deviation of a single value of an effect; 0.0 where it is not known.

    It is that of the fit, at least half of what the equations (``begun``) say otherwise, or of the
    equations where it is held at what these say.
    """
    known = one.stds
    if estimate is not None and path in one.fitted:
        known = spread([other for other in begun if other.part is one.part], estimate)
    return known.get(path, known.get(f'{path}[0]', 0.0))


def left_out(added: tuple[Added, ...], number: int) -> tuple[Added, ...]:
    """Return effects without one of them."""
    return (*added[:number], *added[number + 1:])


def built(servo: Servo, added: Sequence[Added]) -> Servo | None:
    """Return the servo with some effects; None where one needs another that is not there."""
    try:
        return servo_with(servo, added)
    except ServoError:
        return None


def content(servo: Servo) -> tuple[object, ...]:
    """Return what tells the simulation of a file from those of the others of one diagnosis."""
    return servo.mechanism, servo.effects, servo.step, servo.theta.tobytes()
