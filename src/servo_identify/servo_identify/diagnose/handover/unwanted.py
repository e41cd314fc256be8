"""Which effect of several is not taken, since the simulation speaks against it, and why."""

from __future__ import annotations

from collections.abc import Sequence
from operator import or_

import numpy as np

from servo_twin.physics.servo import Servo, Value

from ...fit.estimate import Estimate
from ..decisions import PRACTICAL, WORTH
from .added import Added
from .certainty import spread
from .trial import Trial, Tried


def unwanted(best: Tried, moved: Tried | None, servo: Servo, begun: Sequence[Added],
              trial: Trial) -> tuple[int, str] | None:
    """Return which effect is not taken and why, if one is not; ``begun`` as the equations have."""
    for number, why in (
            (_tolerated(best, servo),
             'its value lies within the tolerance of the servo file'),
            (vanished(best, begun), 'the simulation leaves nothing of it')):
        if number is not None:
            return number, why
    number = _needless(best, moved, trial)
    return None if number is None else (number, (
        'without it the simulation is as near to the rig on the accept recordings'))


def _tolerated(best: Tried, servo: Servo) -> int | None:
    """Return which effect only moves values within their tolerance, if one does."""
    for number, one in enumerate(best.added):
        spans = [(servo.tolerance.get(path), value) for path, value in one.values.items()]
        if all(span is not None and isinstance(value, float) and span[0] <= value <= span[1]
               for span, value in spans):
            return number
    return None


def _needless(best: Tried, moved: Tried | None, trial: Trial) -> int | None:
    """
    Return which effect to remove: that with the least evidence, where there is none.

    The evidence of the equations and that of the simulation add up. What one effect does in a
    simulation shows where nothing else is off: in the nearer of two files. Where all drifts it
    shows little, and the equations decide.
    """
    at = moved if moved is not None and moved.total < best.total else best
    rests = []
    for number in range(len(at.added)):
        rest = trial.without(at, number)
        if rest is not None:
            rests.append((at.added[number].evidence + rest.gap.evidence(at.gap), number))
    evidence, number = min(rests, default=(1.0, 0))
    return number if evidence <= 0.0 else None


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
    rest = best.trial.without(best, number)
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
