"""The values that are handed over, by simulation, and never a file that does worse than given."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ...fit.estimate import Estimate
from .added import Added, servo_with
from .certainty import held_spread, signed, spread, torque_scale, within_spread
from .given_file import GivenFile
from .handover import Handover
from .held_values import surer, waves_held
from .simulated_gap import refitted
from .trial import alike, built, everywhere, left_out, Trial, Tried, vanished


def handed_over(file: GivenFile, several: Sequence[Added], fitting: Sequence[Recording],
                moved_to: Mapping[str, float],
                tick: Callable[[float], None] = lambda share: None) -> Handover:
    """
    Return the missing effects with values fitted by simulation.

    They are fitted together with the values within tolerance, so that neither hides in the other.
    On the accept recordings the better of these values and those of the equations are kept, and
    of a law and its flexible form the one that predicts better, the law where they are alike. An
    effect is dropped where the simulation speaks against it by more than the equations speak for
    it. ``fitting`` are the recordings of the fit at their whole length. ``moved_to`` are the
    values within tolerance as the equations have them beside the effects, by path: one of the
    starts of the fit. What lies outside the plant is taken as the equations show it: the plant
    runs under the recorded command.
    """
    servo, trial, tolerated, warnings = file.servo, file.trial, file.tolerated, []
    outside = [one for one in several if one.part.mechanism.outside]
    several = [one for one in several if one.acts and one not in outside]
    starts = [servo, replace(servo, values={**servo.values, **{
        path: value for path, value in moved_to.items() if path in tolerated}})]
    starts += [] if file.within is None else [file.moved]
    tick(0.3)
    several = [waves_held(one, trial, starts) for one in several]
    joint, chosen, added, base, helps = None, None, tuple(several), servo, False
    while added:
        if built(servo, added) is None:
            added = ()
            break
        joint = _together(starts, added, tolerated, trial)
        if joint is not None:
            added = tuple(surer(one, joint) for one in added)
        tick(0.6)
        alone = _best(servo, added, joint, trial)
        if alone is not None:
            alone, joint = _lawful(starts, alone, joint, tolerated, trial)
        moved = _with_others(alone, joint, tolerated, trial)
        best, helps = _standing(alone, moved, file.given, file.beside, trial)
        if best is None:
            added = ()
            break
        unwanted = _unwanted(best, moved, servo, several, trial)
        if unwanted is None:
            added, chosen, base = best.added, best.estimate, best.base
            break
        number, why = unwanted
        warnings.append(f'{best.added[number].part.mechanism.label} is not taken: {why}')
        added = left_out(best.added, number)
    joint = joint if added else None
    added = (*added, *outside)
    others = [p for p in tolerated if base.values[p] != servo.values[p]]
    if others:
        warnings.append(f'moved within tolerance in the new file: {", ".join(others)}; without '
                        'that, what is added brings the simulation nearer in some recordings only')
    scale, patch = torque_scale(servo, fitting, added), servo_with(base, added)
    stds = {} if chosen is None else spread(several, chosen, scale)
    held = {path for one in added for path in one.held}  # what was searched has none of its own
    stds = {name: std for name, std in stds.items() if name.partition('[')[0] not in held}
    stds |= held_spread(added, patch, scale)
    patch = signed(patch, stds, chosen.bags if chosen is not None else ())
    refit = joint.servo if joint is not None else file.moved
    given = file.given.gap
    gaps = {'given': given, 'patch': trial.gap(patch) or given,
            'refit': trial.gap(refit) or given}
    return Handover(servo, base, added, patch, refit, file.moved, joint,
                    helps or added == tuple(outside), gaps, tuple(warnings), stds)


def _together(starts: Sequence[Servo], added: Sequence[Added], tolerated: Sequence[str],
              trial: Trial) -> Estimate | None:
    """
    Return effects fitted together with the values within tolerance, by simulation.

    The fit begins at the nearest of some ``starts``. Where it ends no nearer to the rig than they
    are without the effects, it stopped short, and begins at the next.
    """
    several = [servo_with(_moved(starts[0], tolerated, added, one), added) for one in starts]
    free = [path for one in added for path in one.fitted]
    bare, ends = min(map(trial.misfit, starts)), []
    for base in sorted(several, key=trial.misfit):
        end = refitted(base, trial.fitting,
                       [*free, *(p for p in tolerated if p in base.tolerance)])
        if end is not None:
            ends.append(end)
            if trial.misfit(end.servo) < bare:
                break
    return min(ends, key=lambda end: trial.misfit(end.servo), default=None)


def _best(servo: Servo, added: tuple[Added, ...], joint: Estimate | None,
          trial: Trial) -> Tried | None:
    """
    Return the effects at the values that do best on the accept recordings.

    They come from the equations, from the fit together with the tolerances, or from one without
    these, within what the two leave open: beyond, they would make up for other values.
    """
    several = [trial.of(servo, added, joint)]
    if joint is not None:
        together = _at_values(added, joint.servo)
        several.append(trial.of(servo, together, joint))
        free = [path for one in added for path in one.fitted]
        without = refitted(servo_with(servo, together), trial.fitting, free,
                           bounds=within_spread(added, joint))
        if without is not None:
            several.append(trial.of(servo, _at_values(added, without.servo), joint))
    return min((one for one in several if one), key=lambda one: one.total, default=None)


def _lawful(starts: Sequence[Servo], best: Tried, joint: Estimate | None,
            tolerated: Sequence[str], trial: Trial) -> tuple[Tried, Estimate | None]:
    """
    Return the effects with the law of the catalogue where it predicts as well as the curve.

    The fit together with the tolerances comes with them.
    """
    for number, one in enumerate(best.added):
        if one.as_law is None:
            continue
        law = replace(one.as_law, evidence=one.evidence * one.as_law.holds)
        lawful = (*best.added[:number], law, *best.added[number + 1:])
        fitted = _together(starts, lawful, tolerated, trial)
        tried = _best(starts[0], lawful, fitted, trial)
        if tried is not None and tried.total <= best.total:
            best, joint = tried, fitted
    return best, joint


def _with_others(alone: Tried | None, joint: Estimate | None, tolerated: Sequence[str],
                 trial: Trial) -> Tried | None:
    """
    Return the effects in the file with its other values moved as well, as the fit has both.

    Beside values that are off it may take these to do any good.
    """
    if alone is None or joint is None:
        return None
    base = _moved(alone.base, tolerated, alone.added, joint.servo)
    return trial.of(base, _at_values(alone.added, joint.servo), joint)


def _standing(alone: Tried | None, moved: Tried | None, given: Tried, beside: Tried,
              trial: Trial) -> tuple[Tried | None, bool]:
    """
    Return the effects as they are best handed over, and whether they help.

    In the file as given (``alone``) where that is enough, else with the others ``moved``; against
    the file as ``given``, or with these moved without any effect (``beside``).
    """
    if alone is None:
        return None, False
    if moved and moved.total < alone.total and not everywhere(given, alone):
        bare = trial.of(moved.base)
        return moved, moved.total < beside.total or alike(beside, moved) or (
            bare is not None and alike(bare, moved))
    return alone, _helps(given, alone)


def _helps(before: Tried, after: Tried) -> bool:
    return after.total < before.total or alike(before, after)


def _unwanted(best: Tried, moved: Tried | None, servo: Servo, begun: Sequence[Added],
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
        rest = trial.of(at.base, left_out(at.added, number))
        if rest is not None:
            rests.append((at.added[number].evidence + rest.gap.evidence(at.gap), number))
    evidence, number = min(rests, default=(1.0, 0))
    return number if evidence <= 0.0 else None


def _moved(servo: Servo, paths: Sequence[str], added: Sequence[Added], to: Servo) -> Servo:
    """Return a servo with some values as in another, but those that effects bring themselves."""
    own = {path for one in added for path in one.values}
    return replace(servo, values={**servo.values, **{p: to.values[p] for p in paths
                                                     if p in to.values and p not in own}})


def _at_values(added: Sequence[Added], servo: Servo) -> tuple[Added, ...]:
    """Return effects at the values of a servo; what is held or a curve there keeps its own."""
    return tuple(replace(one, values={
        path: value if path in one.held else servo.values.get(path, value)
        for path, value in one.values.items()}) for one in added)
