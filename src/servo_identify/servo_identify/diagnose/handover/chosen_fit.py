"""The values that are handed over, by simulation, and never a file that does worse than given."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from servo_twin.physics.element_names import split_name
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ...fit.estimate import Estimate
from .added import Added, servo_with
from .certainty import held_spread, signed, spread, torque_scale, within_spread
from .given_file import GivenFile
from .handover import Handover
from .held_values import surer, waves_held
from .simulated_gap import refitted
from .trial import alike, built, everywhere, left_out, Trial, Tried
from .unwanted import unwanted


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
    starts = [servo, servo.with_values({
        path: value for path, value in moved_to.items() if path in tolerated})]
    starts += [] if file.within is None else [file.moved]
    tick(0.3)
    several = [waves_held(one, trial, starts) for one in several]
    joint, added, files = None, tuple(several), []
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
        moved = _with_others(alone, joint, file)
        files = _standing(alone, moved, file, trial)
        if not files:
            added = ()
            break
        best = files[0].tried
        refused = unwanted(best, moved, servo, several, trial)
        if refused is None:
            break
        number, why = refused
        warnings.append(f'{best.added[number].part.mechanism.label} is not taken: {why}')
        added = left_out(best.added, number)
    if not added:
        joint, files = None, [_Standing(file.given, helps=True)]
    first, *others = [_handover(one, file, several, outside, joint, fitting, warnings)
                      for one in files]
    return replace(first, otherwise=others[0] if others else None)


@dataclass(frozen=True)
class _Standing:
    """Effects in a file, and whether they help on the accept recordings."""

    tried: Tried
    helps: bool


def _handover(one: _Standing, file: GivenFile, begun: Sequence[Added], outside: Sequence[Added],
              joint: Estimate | None, fitting: Sequence[Recording], warnings: Sequence[str]
              ) -> Handover:
    """
    Return what is handed over of effects in a file.

    ``begun`` are the effects as the equations have them, ``outside`` those of no simulation.
    """
    tried, servo, trial = one.tried, file.servo, file.trial
    added = (*tried.added, *outside)
    scale, patch = torque_scale(servo, fitting, added), servo_with(tried.base, added)
    stds = {} if tried.estimate is None else spread(begun, tried.estimate, scale)
    held = {path for each in added for path in each.held}  # what was searched has none of its own
    stds = {name: std for name, std in stds.items() if name.partition('[')[0] not in held}
    stds |= held_spread(added, patch, scale)
    patch = signed(patch, stds, () if tried.estimate is None else tried.estimate.bags)
    refit, given = file.moved if joint is None else joint.servo, file.given.gap
    gaps = {'given': given, 'patch': trial.gap(patch) or given,
            'refit': trial.gap(refit) or given}
    moved = [path for path in file.tolerated if tried.base.number(path) != servo.number(path)]
    said = [] if not moved else [
        f'moved within tolerance in the new file: {", ".join(moved)}; without that, what is '
        'added brings the simulation nearer in some recordings only']
    return Handover(servo, tried.base, added, patch, refit, file.moved, joint, one.helps, gaps,
                    (*warnings, *said), stds)


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


def _with_others(alone: Tried | None, joint: Estimate | None, file: GivenFile) -> Tried | None:
    """
    Return the effects in the file with its other values moved as well, as the fit has both.

    Beside values that are off it may take these to do any good. What the equations know better is
    held, and where that does no good, all is as the fit has it.
    """
    if alone is None or joint is None:
        return None
    base = _moved(alone.base, file.tolerated, alone.added, joint.servo)
    held = file.trial.of(base, _at_values(alone.added, joint.servo), joint)
    if held is not None and _helps(file.beside, held):
        return held
    free = tuple(replace(one, held=frozenset()) for one in alone.added)
    return file.trial.of(base, _at_values(free, joint.servo), joint)


def _standing(alone: Tried | None, moved: Tried | None, file: GivenFile, trial: Trial
              ) -> list[_Standing]:
    """
    Return the effects as they are best handed over, and what stands in where that does worse.

    In the file as given (``alone``) where that is enough, else with the others ``moved``; against
    the file as given, or with these moved without any effect.
    """
    if alone is None:
        return []
    helps = _helps(file.given, alone)
    if moved is None or moved.total >= alone.total:
        return [_Standing(alone, helps)]
    bare = trial.of(moved.base)
    beside = _Standing(moved, _helps(file.beside, moved) or (
        bare is not None and alike(bare, moved)))
    return [_Standing(alone, helps), beside] if everywhere(file.given, alone) else [beside]


def _helps(before: Tried, after: Tried) -> bool:
    return after.total < before.total or alike(before, after)


def _moved(servo: Servo, paths: Sequence[str], added: Sequence[Added], to: Servo) -> Servo:
    """Return a servo with some values as in another, but those that effects bring themselves."""
    own = {path for one in added for path in one.values}
    return servo.with_values({name: to.number(name) for name in paths for path in [
        split_name(name)[0]] if path in to.values and path not in own})


def _at_values(added: Sequence[Added], servo: Servo) -> tuple[Added, ...]:
    """Return effects at the values of a servo; what is held or a curve there keeps its own."""
    return tuple(replace(one, values={
        path: value if path in one.held else servo.values.get(path, value)
        for path, value in one.values.items()}) for one in added)
