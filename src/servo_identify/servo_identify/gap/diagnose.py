"""From recordings of one machine and its servo file to the answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .acceptance import accept, run_over, tried
from .answer import GapReport
from .balance import Balance
from .cancelling import without_cancelling
from .candidates import candidates_of, extend, Extended
from .checks import CannotDiagnose, check, unsaturated
from .evidence import Evidence, Findings, gathered
from .experiment_choice import next_experiment
from .explanation import as_given, fit
from .free_law import undisputed
from .library import build_library
from .observation import Observation, observe
from .resimulation import Diverged, Gap
from .screening import Screening
from .selection import Selection
from .shape_values import shape_values
from .splitting import Split, split
from .stack import Stack
from .stages import Stages
from .status import judged
from .verdict import report_of
from .wrong_reading import wrong_reading

RUNAWAY = 100.0  # times the gap without causes at which a twin with some has run away
ROUNDS = 3  # of fitting the tolerances of a mesh with a gap, the last one for the columns


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

    ``without`` names causes that shall not be considered; ``tick(stage, share)`` reports
    progress. Raises checks.CannotDiagnose with a sentence for recordings that cannot be judged.
    """
    stages = Stages(tick)
    stages.begin('noise')
    parts, warnings = _parted(recordings, accepting, reporting, servo)
    seen = observe([*parts.screen, *parts.accept, *parts.report], servo)
    channels = tuple(sorted({n for o in seen for n in o.noise if o.recording.has(n)}))
    sides = ('motor', 'load') if all(o.has('torque') for o in seen) else ('load',)
    extended, purposes, stacks = _settled(extend(servo, sides, channels, without), parts, seen)

    stages.begin('signatures')
    start = _bare(stacks['screen']).residual([])
    candidates = candidates_of(extended, shape_values(stacks['screen'], start))
    library = build_library(stacks['screen'], candidates, stages.share)

    screening = Screening(stacks['screen'], library)
    kept, fallen, disputed = _standing(Selection(screening), purposes['accept'],
                                       stacks['accept'], stages)
    warnings += fallen
    try:
        base = tried(screening, [], purposes['accept'])
        given = run_over(as_given(stacks['screen']), purposes['report'])
        bare = run_over(base.explanation, purposes['report'])
    except Diverged as problem:
        raise CannotDiagnose(str(problem)) from None
    while kept and not _runs(screening, kept, purposes['report'], bare):
        dropped = kept.pop()
        warnings.append(f'{library.candidates[dropped].label} makes the twin run away on the '
                        'report recordings and is not taken')

    known = Findings(servo, parts, purposes, stacks, start, given, base, bare,
                     wrong_reading(screening, kept), disputed)
    evidence = gathered(known, screening, kept, stages)
    while unnamed := _unnamed(evidence, kept):
        warnings.append('explains a part, but not as its cause, and is not taken: '
                        + ', '.join(library.candidates[one].label for one in unnamed))
        kept = [one for one in kept if one not in unnamed]
        evidence = gathered(known, screening, kept, stages)
    following = next_experiment(evidence, screening, kept)
    stages.end()
    report = report_of(evidence, following, warnings, stages.seconds)
    return Diagnosis(report, evidence.augmented, evidence)


def _parted(recordings: list[Recording], accepting: list[Recording], reporting: list[Recording],
            servo: Servo) -> tuple[Split, list[str]]:
    """Return the recordings by purpose and what is to be said of them. Raises CannotDiagnose."""
    warnings, given = [], []
    for some in (recordings, accepting, reporting):
        kept, left_out = unsaturated(list(some), servo)
        given.append(kept)
        warnings += left_out
    parts = split(*given)
    return parts, [*warnings, *check([one for some in given for one in some], servo),
                   *parts.warnings]


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


def _unnamed(evidence: Evidence, kept: list[int]) -> list[int]:
    """Return the causes that the evidence does not bear out, though they explain a part."""
    named = {cause.key for cause in judged(evidence).named}
    return [one for one, choice in zip(kept, evidence.choices, strict=True)
            if choice.candidate.key not in named]


def _standing(selection: Selection, balances: list[Balance], others: Stack,
              stages: Stages) -> tuple[list[int], list[str], dict[str, tuple[str, ...]]]:
    """
    Return (causes that are asked for and stand on other recordings, why others fell, disputed).

    The last are by balance the variables of laws that do more than what is known.
    """
    screening = selection.screening
    stages.begin('screening')
    chosen = selection.select(stages.share)
    kept, undone = without_cancelling(screening, chosen)
    kept = selection.pruned(kept) if undone else kept
    stages.begin('acceptance')
    kept, fallen = accept(screening, kept, balances, others, stages.share)
    kept, outdone, disputed = undisputed(screening, kept)
    needed = selection.pruned(kept) if len(kept) < len(chosen) else kept
    needless = [f'{screening.library.candidates[one].label} was there for what fell beside it'
                for one in kept if one not in needed]
    return needed, [*undone, *fallen, *outdone, *needless], disputed


def _bare(stack: Stack) -> Screening:
    return Screening(stack, build_library(stack, [], lambda share: None))


def _runs(screening: Screening, kept: list[int], balances: list[Balance], bare: Gap) -> bool:
    """Tell whether the twin with some causes stays near a rig that it was not fitted to."""
    try:
        gap = tried(screening, kept, balances).gap
    except Diverged:
        return False
    return gap.total(bare) <= RUNAWAY * bare.total(bare)
