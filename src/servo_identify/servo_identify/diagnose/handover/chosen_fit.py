"""The values that are handed over, by simulation, and never a file that does worse than given."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from servo_twin.physics.servo import Servo, ServoError
from servo_twin.recording.recording import Recording

from ...fit.estimate import Estimate
from ..decisions import PRACTICAL, WORTH
from .added import Added, servo_with
from .certainty import signed, spread
from .simulated_gap import Diverged, Gap, refitted, shrink_interval, simulated

SECONDS = 16.0  # of recordings that a refit runs over: more moves its values by little
JUDGED = 60.0  # s of the accept recordings that a choice is judged on


@dataclass(frozen=True)
class Handover:
    """
    What a diagnosis hands over.

    ``added`` the missing effects that stand the comparison; ``patch`` the servo as given with
    them; ``refit`` with values within tolerance moved as well; ``within`` the servo as given with
    those moved alone. ``base`` is what the patch adds to: the servo as given or, where its values
    are so far off that no addition does any good, with these moved within tolerance. ``joint`` is
    the estimate behind ``refit``, ``gaps`` the errors on the accept recordings by name;
    ``warnings`` what is to be said; ``chosen`` the standard deviations of the values in ``patch``
    by name, where a fit gave them.
    """

    servo: Servo
    base: Servo
    added: tuple[Added, ...]
    patch: Servo
    refit: Servo
    within: Servo
    joint: Estimate | None
    gaps: Mapping[str, Gap]
    warnings: tuple[str, ...]
    chosen: Mapping[str, float] = field(default_factory=dict)

    def without(self, one: Added) -> Servo:
        """Return the patch without one of its effects, its base where others need it."""
        others = [other for other in self.added if other is not one]
        return (_built(self.base, others) if others else None) or self.base


def handed_over(servo: Servo, several: Sequence[Added], fitting: Sequence[Recording],
                accepting: Sequence[Recording],
                tick: Callable[[float], None] = lambda share: None) -> Handover:
    """
    Return the missing effects with values fitted by simulation.

    They are fitted together with the values within tolerance, so that neither hides in the other.
    On the accept recordings the better of these values and those of the equations are kept, and
    of a law and its flexible form the one that predicts better, the law where they are alike. An
    effect whose removal does not hurt there is dropped. What the controller does otherwise is
    taken as its equation shows it: the plant runs under the recorded command.
    """
    short, warnings = shortened(fitting), []
    accepting = shortened(accepting, JUDGED)
    loop = [one for one in several if one.part.mechanism.site == 'controller']
    several = [one for one in several if one.acts and one not in loop]
    tolerated = [path for path in servo.tolerance
                 if path.split('.')[0] in ('drive', 'mechanism', 'effects')]
    within = refitted(servo, short, tolerated, near=False)
    starts = [servo] if within is None else [servo, within.servo]
    tick(0.3)
    given = _gap(servo, accepting)
    if given is None:
        raise Diverged(f'{servo.name}: the simulation leaves the finite numbers on the '
                       'recordings; its step may be too long')
    joint, chosen, added, judged = None, None, tuple(several), servo
    while added:
        base = _built(servo, added)
        if base is None:
            added = ()
            break
        joint = _together(starts, added, tolerated, short)
        tick(0.6)
        best = _best(servo, added, joint, accepting)
        if best is not None:
            best, joint = _lawful(starts, best, joint, tolerated, short, accepting)
        judged, most = servo, given.total()
        # beside values that are off it may take those moved as well to do any good
        ground, moved = servo, None
        if best is not None and joint is not None:
            changed = {path for one in best.added for path in one.values}
            ground = _moved(servo, [p for p in tolerated if p not in changed], joint.servo)
            moved = _tried(ground, _at_values(best.added, joint.servo), joint, accepting)
        enough = best is not None and _everywhere(given, best.gap) and _everywhere(
            _gap(servo, short), _gap(_built(servo, best.added), short))
        if best and moved and not enough and moved.gap.total() < best.gap.total():
            judged, best = ground, moved
            most = _total(within.servo if within else servo, accepting)
        helps = best is not None and (best.gap.total() < most or _alike(
            judged, _built(judged, best.added), best.gap, short, accepting))
        if moved and not helps:  # what the others hide shows against the others moved alone
            beside = within.servo if within else servo
            if moved.gap.total() < _total(beside, accepting) or _alike(
                    beside, _built(ground, moved.added), moved.gap, short, accepting):
                judged, best, helps = ground, moved, True
        if best is None or len(added) == 1 and not helps:
            names = ', '.join(one.part.mechanism.label for one in added)
            warnings.append(f'{names}: a simulation with it is no nearer to the rig on the accept '
                            'recordings; the file stays as given')
            added, joint, judged = (), None, servo
            break
        # what one effect does shows where nothing else is off
        base, at = (ground, moved) if moved is not None and (
            moved.gap.total() < best.gap.total()) else (judged, best)
        most = at.gap.total() + PRACTICAL * given.total() if helps else np.inf
        needless = _needless(base, at, most, accepting) if len(added) > 1 else None
        if needless is None:
            added, chosen = best.added, best.estimate
            break
        warnings.append(f'{best.added[needless].part.mechanism.label} is not taken: without it '
                        'the simulation is as near to the rig on the accept recordings')
        added = (*best.added[:needless], *best.added[needless + 1:])
    added = (*added, *loop)
    if judged is not servo:
        others = [p for p in tolerated if judged.values[p] != servo.values[p]]
        warnings.append(f'moved within tolerance in the new file: {", ".join(others)}; without '
                        'that, what is added brings the simulation nearer in some recordings only')
    stds = spread(several, chosen) if chosen is not None else {}
    patch = signed(servo_with(judged, added), stds, chosen.bags if chosen is not None else ())
    refit = joint.servo if joint is not None else (within.servo if within else servo)
    gaps = {'given': given, 'patch': _gap(patch, accepting) or given}
    return Handover(servo, judged, added, patch, refit, within.servo if within else servo, joint,
                    gaps, tuple(warnings), stds)


@dataclass(frozen=True)
class Tried:
    """Missing effects at some values: their gap on the accept recordings, the fit behind them."""

    added: tuple[Added, ...]
    gap: Gap
    estimate: Estimate | None


def _together(starts: Sequence[Servo], added: Sequence[Added], tolerated: Sequence[str],
              short: Sequence[Recording]) -> Estimate | None:
    """
    Return effects fitted together with the values within tolerance, by simulation.

    The fit begins at the nearer of some ``starts``: far from the rig it may stop short of it.
    """
    changed = {path for one in added for path in one.values}
    several = [servo_with(_moved(starts[0], [p for p in tolerated if p not in changed], one),
                          added) for one in starts]
    base = min(several, key=lambda one: _total(one, short))
    free = [path for one in added for path in one.free]
    return refitted(base, short, [*free, *(p for p in tolerated if p in base.tolerance)])


def _best(servo: Servo, added: tuple[Added, ...], joint: Estimate | None,
          accepting: Sequence[Recording]) -> Tried | None:
    """
    Return the effects at the values that do best on the accept recordings.

    They come from the equations or from the fit together with the tolerances. Fitted alone, they
    would make up for every other value that is off.
    """
    several = [_tried(servo, added, None, accepting)]
    if joint is not None:
        several.append(_tried(servo, _at_values(added, joint.servo), joint, accepting))
    return min((one for one in several if one), key=lambda one: one.gap.total(), default=None)


def _tried(servo: Servo, added: tuple[Added, ...], by: Estimate | None,
           accepting: Sequence[Recording]) -> Tried | None:
    gap = _gap(_built(servo, added), accepting)
    return None if gap is None else Tried(added, gap, by)


def _moved(servo: Servo, paths: Sequence[str], to: Servo) -> Servo:
    """Return the servo as given with some of its values as in another."""
    return replace(servo, values={**servo.values, **{p: to.values[p] for p in paths
                                                     if p in to.values}})


def _alike(before: Servo, after: Servo | None, gap: Gap, fitting: Sequence[Recording],
           accepting: Sequence[Recording]) -> bool:
    """
    Tell whether effects bring the simulation nearer where they were fitted, and harm nowhere.

    ``gap`` is theirs on the accept recordings. On a short one a right effect may gain nothing;
    that is no ground against it. It is one where the 90 % interval of its gain lies below zero.
    """
    fitted, known, given = _gap(after, fitting), _gap(before, fitting), _gap(before, accepting)
    return (fitted is not None and known is not None and given is not None
            and fitted.total() < known.total() and shrink_interval(given, gap)[1] > 0.0)


def _everywhere(before: Gap | None, after: Gap | None) -> bool:
    """Tell whether a gap is smaller by what is worth naming, and larger in no recording."""
    if before is None or after is None or after.total() > (1.0 - WORTH) * before.total():
        return False
    several = [np.flatnonzero(before.recording == n) for n in np.unique(before.recording)]
    return all(after.total(blocks) <= before.total(blocks) for blocks in several)


def _total(servo: Servo | None, recordings: Sequence[Recording]) -> float:
    gap = _gap(servo, recordings)
    return np.inf if gap is None else gap.total()


def _lawful(starts: Sequence[Servo], best: Tried, joint: Estimate | None, tolerated: Sequence[str],
            short: Sequence[Recording], accepting: Sequence[Recording]
            ) -> tuple[Tried, Estimate | None]:
    """
    Return the effects with the law of the catalogue where it predicts as well as the curve.

    The fit together with the tolerances comes with them.
    """
    for one in best.added:
        if one.as_law is None:
            continue
        lawful = tuple(one.as_law if other is one else other for other in best.added)
        fitted = _together(starts, lawful, tolerated, short)
        tried = _best(starts[0], lawful, fitted, accepting)
        if tried is not None and tried.gap.total() <= best.gap.total():
            best, joint = tried, fitted
    return best, joint


def _needless(servo: Servo, best: Tried, most: float,
              accepting: Sequence[Recording]) -> int | None:
    """Return which effect hurts least to remove, if what is left then is at most ``most``."""
    rests = []
    for number in range(len(best.added)):
        others = (*best.added[:number], *best.added[number + 1:])
        rest = _gap(_built(servo, others), accepting)
        if rest is not None and rest.total() <= most:
            rests.append((rest.total(), number))
    return min(rests)[1] if rests else None


def _at_values(added: Sequence[Added], servo: Servo) -> tuple[Added, ...]:
    """Return effects at the values of a servo; a law that it has as a curve keeps its own."""
    return tuple(replace(one, values={path: servo.values.get(path, value)
                                      for path, value in one.values.items()}) for one in added)


def _built(servo: Servo, added: Sequence[Added]) -> Servo | None:
    """Return the servo with some effects; None where one needs another that is not there."""
    try:
        return servo_with(servo, added)
    except ServoError:
        return None


def _gap(servo: Servo | None, recordings: Sequence[Recording]) -> Gap | None:
    if servo is None:
        return None
    try:
        return simulated(servo, recordings).gap
    except (Diverged, ServoError, np.linalg.LinAlgError):
        return None


def shortened(recordings: Sequence[Recording], seconds: float = SECONDS) -> list[Recording]:
    """
    Return as much of the recordings as a refit needs.

    Where all together are longer, one of the replicates of each excitation stands for the others,
    and of what is left each is cut to its first part.
    """
    several = list(recordings)
    if sum(one.duration for one in several) > seconds:
        several = list({one.family or one.name: one for one in reversed(several)}.values())[::-1]
    together = sum(one.duration for one in several)
    if together <= seconds:
        return several
    kept = []
    for one in several:
        size = max(int(3.0 / one.period), int(len(one) * seconds / together))
        kept.append(replace(one, columns={n: np.ascontiguousarray(c[:size])
                                          for n, c in one.columns.items()}))
    return kept
