"""From recordings of one machine and its servo file to the answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import time

import numpy as np

from servo_twin.physics.effect import Effect
from servo_twin.physics.servo import Servo
from servo_twin.recording import Recording

from .acceptance import accept, leftover, run_over, Trial, tried
from .answer import GapReport
from .balance import Balance, BALANCES
from .candidates import candidates_of, extend, Extended
from .checks import CannotDiagnose, check, unsaturated
from .completeness import Remainder, remainder, repeatable
from .experiment_choice import next_experiment
from .explanation import as_given, augmented, fit
from .library import build_library
from .observation import Observation, observe
from .resimulation import Diverged
from .scales import orders, Scales
from .screening import Screening
from .selection import Choice, Selection
from .splitting import Split, split
from .stack import Stack
from .verdict import NOTICED, report_of, status_of

ROUNDS = 3  # of fitting the tolerances of a mesh with a gap, the last one for the columns
FAR_ABOVE = 2.0  # mean square in units of noise and margin that is no noise any more
ERRATIC = 4.0  # the same where replicates have nothing in common and no cause was found
STAGES = ('reading', 'noise', 'signatures', 'screening', 'acceptance', 'completeness', 'shrink')


@dataclass(frozen=True)
class Evidence:
    """Everything behind a report that the page draws."""

    servo: Servo
    augmented: Servo
    split: Split
    stacks: dict[str, Stack]
    start: np.ndarray
    left: np.ndarray
    choices: tuple[Choice, ...]
    base: Trial
    best: Trial
    remainders: tuple[Remainder, ...]
    reported: dict


@dataclass(frozen=True)
class Diagnosis:
    """The report, the servo with the accepted causes in it, and the evidence."""

    report: GapReport
    augmented: Servo
    evidence: Evidence


def diagnose(recordings: list[Recording], servo: Servo, accepting: list[Recording] = (),
             reporting: list[Recording] = (), without: tuple[str, ...] = (),
             tick: Callable[[str, float], None] = lambda stage, share: None) -> Diagnosis:
    """
    Say where a twin departs from its rig, which effect causes it and how far the gap shrinks.

    ``without`` names effects that shall not be considered; ``tick(stage, share)`` reports
    progress. Raises checks.CannotDiagnose with a sentence for recordings that cannot be judged.
    """
    clock = {}
    began = time.perf_counter()

    def lap(stage):
        spent = time.perf_counter() - began - sum(clock.values())
        clock[stage] = round(clock.get(stage, 0.0) + spent, 3)

    tick('noise', 0.0)
    warnings, given = [], []
    for some in (recordings, accepting, reporting):
        kept, left_out = unsaturated(list(some), servo)
        given.append(kept)
        warnings += left_out
    parts = split(*given)
    everything = [*parts.screen, *parts.accept, *parts.report]
    warnings += [*check([one for some in given for one in some], servo), *parts.warnings]
    seen = observe(everything, servo)
    channels = tuple(sorted({n for o in seen for n in o.noise if o.recording.has(n)}))
    torque = all(o.has('torque') for o in seen)
    extended = extend(servo, ('motor', 'load') if torque else ('load',), channels, without)
    extended, purposes, stacks = _settled(extended, parts, seen)
    lap('noise')

    bare = _bare(stacks['screen'])
    start = bare.residual([])
    candidates = candidates_of(extended, _shapes(extended, bare, start))
    library = build_library(stacks['screen'], candidates, lambda s: tick('signatures', s))
    lap('signatures')
    screening = Screening(stacks['screen'], library)
    selection = Selection(screening)
    chosen = selection.select(lambda s: tick('screening', s))
    lap('screening')
    names = tuple(f'{r.name}@{r.digest[:12]}' if r.digest else r.name for r in parts.screen)
    kept, fallen = accept(screening, chosen, purposes['accept'], stacks['accept'],
                          lambda s: tick('acceptance', s))
    warnings += fallen
    try:
        base = tried(screening, [], purposes['accept'])
        given = run_over(as_given(stacks['screen']), purposes['report'])
        run_over(base.explanation, purposes['report'])
    except Diverged as problem:
        raise CannotDiagnose(str(problem)) from None
    while kept and not _runs(screening, kept, purposes['report']):
        dropped = kept.pop()
        warnings.append(f'{library.candidates[dropped].label} makes the twin diverge on the '
                        'report recordings and is not taken')

    def evidence_with(kept: list[int]) -> Evidence:
        best = tried(screening, kept, purposes['accept'])
        better = augmented(servo, stacks['screen'], best.explanation, names)
        choices = tuple(selection.explain(kept))
        lap('acceptance')
        tick('completeness', 0.0)
        left = screening.residual(kept)
        remainders = _remainders(stacks, left, best, bool(kept))
        lap('completeness')
        tick('shrink', 0.0)
        reported = {
            'given': given,
            'base': run_over(base.explanation, purposes['report']),
            'best': run_over(best.explanation, purposes['report']),
            'steps': _steps(screening, kept, purposes),
            'left': leftover(stacks['report'], best.explanation),
        }
        lap('shrink')
        return Evidence(servo, better, parts, stacks, start, left, choices, base, best,
                        remainders, reported)

    evidence = evidence_with(kept)
    if kept and status_of(evidence) == 'unknown':
        warnings.append('explains a part, but not as its cause, and is not taken: '
                        + ', '.join(library.candidates[one].label for one in kept))
        kept = []
        evidence = evidence_with(kept)
    following = next_experiment(evidence, screening, kept)
    lap('shrink')
    report = report_of(evidence, following, warnings, clock)
    return Diagnosis(report, evidence.augmented, evidence)


def _remainders(stacks: dict[str, Stack], left: np.ndarray, best: Trial,
                found: bool) -> tuple[Remainder, ...]:
    """Describe what is left in each balance that still shows a gap."""
    screen, accepting = stacks['screen'], stacks['accept']
    remainders = [remainder(screen, left, BALANCES[i]) for i in np.unique(screen.balance)
                  if np.mean(left[screen.balance == i]**2) > NOTICED]
    common = repeatable(screen, left, accepting, leftover(accepting, best.explanation))
    return tuple(replace(r, predictable=_unexplained(r, common, found)) for r in remainders)


def _settled(extended: Extended, parts: Split, seen: list[Observation]):
    """
    Return (extended servo, balances, stacks by purpose) at the values within tolerance that fit.

    A law with kinks is not linear in its tolerances, and the zero of a gap hangs on its width:
    what is linear later is taken where the values fit best.
    """
    for following in range(ROUNDS)[::-1]:
        purposes, at = {}, 0
        for purpose in ('screen', 'accept', 'report'):
            size = len(getattr(parts, purpose))
            purposes[purpose] = [Balance(extended.servo, o, extended.given, extended.theta)
                                 for o in seen[at:at + size]]
            at += size
        stacks = {purpose: Stack(balances, extended) for purpose, balances in purposes.items()}
        if not following or not any(one.has_gap for one in purposes['screen']):
            return extended, purposes, stacks
        extended = replace(extended, theta=fit(_bare(stacks['screen']), []).theta)


def _bare(stack: Stack) -> Screening:
    return Screening(stack, build_library(stack, [], lambda share: None))


def _unexplained(left: Remainder, common: dict[str, float], found: bool) -> float:
    """
    Mean square that some law must explain.

    Without replicates all that is far above the noise. With them what they have in common; but
    where nothing was found, so much that no sensor can have made it is a gap though erratic.
    """
    above = left.square - 1.0
    if left.balance in common:
        erratic = above if not found and left.square > ERRATIC else 0.0
        return max(left.predictable, common[left.balance], erratic)
    return max(left.predictable, above if left.square > FAR_ABOVE else 0.0)


def _runs(screening: Screening, kept: list[int], balances: list[Balance]) -> bool:
    try:
        tried(screening, kept, balances)
    except Diverged:
        return False
    return True


def _steps(screening: Screening, kept: list[int], purposes: dict) -> list[dict]:
    """Gaps with the causes added one by one, and with each alone and left out."""
    sets: dict[tuple[int, ...], dict] = {}

    def gaps(chosen: list[int]) -> dict:
        key = tuple(sorted(chosen))
        if key not in sets:
            explanation = fit(screening, list(key))
            try:
                sets[key] = {purpose: run_over(explanation, purposes[purpose])
                             for purpose in ('accept', 'report')}
            except Diverged:  # a part of the causes alone need not be a machine that runs
                sets[key] = gaps([])
        return sets[key]

    steps = []
    for number, one in enumerate(kept):
        ways = {'upto': kept[:number + 1], 'rest': [c for c in kept if c != one], 'alone': [one]}
        steps.append({purpose: {way: gaps(chosen)[purpose] for way, chosen in ways.items()}
                      for purpose in ('accept', 'report')})
    return steps


def _shapes(extended: Extended, bare: Screening, start: np.ndarray):
    """Return a function that lists the shape values worth trying for an effect at a site."""
    scales = Scales(bare.stack.balances)
    spectra: dict[tuple[str, str], tuple[float, ...]] = {}

    def found(effect: type[Effect], site: str) -> tuple[float, ...]:
        balance, angle = _periodic(effect, site, bare.stack)
        weight = {'position_dependent_friction': 'load_speed',
                  'position_dependent_backlash': 'torque',
                  'torque_ripple': 'current'}.get(effect.name, '')
        key = (balance, angle, weight)
        if key not in spectra:
            spectra[key] = _spectrum(bare.stack, start, balance, angle, weight)
        return spectra[key]

    def shapes(effect: type[Effect], site: str) -> list[dict[str, float]]:
        grid = scales.grid(effect, site)
        order = effect.parameters.get('order')
        if order is None or order.row:
            return grid
        values = found(effect, site) if order.grid else ()
        values = values or order.grid or (order.default,)
        return [{**others, 'order': float(v)} for others in grid for v in values]

    return shapes


def _periodic(effect: type[Effect], site: str, stack: Stack) -> tuple[str, str]:
    names = {n for one in stack.balances for n in one.names}
    if effect.port in ('mesh_error', 'clearance', 'mesh'):
        return 'transmission', 'load_angle'
    angle = 'motor_angle' if site == 'motor' else 'load_angle'
    if 'torque' in names:
        return 'torque', angle
    return ('motor' if site == 'motor' else 'load'), angle


def _spectrum(stack, residual, balance, angle, weight) -> tuple[float, ...]:
    angles, values = [], []
    for number, one in enumerate(stack.balances):
        if balance not in one.names:
            continue
        kept = stack.kept(number, balance)
        rows = (stack.balance == BALANCES.index(balance)) & (stack.recording == number)
        factor = np.sign(one.weighed(weight, balance)[kept]) if weight else 1.0
        angles.append(one.weighed(angle, balance)[kept])
        values.append(residual[rows] * factor)
    return orders(np.concatenate(angles), np.concatenate(values)) if angles else ()
