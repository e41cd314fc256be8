"""From recordings of one machine and its servo file to the answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import cache, partial

from threadpoolctl import threadpool_limits

from servo_twin.description.given_values import defaults
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ..data.finding import Finding as Said
from ..data.finding import refusal
from ..data.recording_check import check as check_data
from ..data.recording_check import replicates
from ..experiment.reach_limits import check_reach
from .answer.evidence import Evidence
from .answer.experiments import next_experiment
from .answer.verdict import report_of
from .checks import CannotDiagnose, check, usable
from .contest import Contest
from .decisions import EVEN
from .diagnosis import Diagnosis
from .handed import begun, Handed, handed_in, selecting
from .handover.cut import Cut
from .handover.simulated_gap import Diverged, Simulated, simulated
from .handover.trial import as_in, content
from .mechanisms.every_hypothesis import check_without
from .residuals.samples import residual_samples
from .selection.confidence import preferred
from .selection.explain import explained
from .selection.stability import Half, halves
from .splitting import Split, split
from .stages import Stages


@threadpool_limits.wrap(limits=1, user_api='blas')  # its own threads are one to a core
def diagnose(recordings: Sequence[Recording], servo: Servo, accepting: Sequence[Recording] = (),
             reporting: Sequence[Recording] = (), without: Sequence[str] = (),
             tick: Callable[[str, float], None] = lambda stage, share: None,
             reach: Mapping[str, float] | None = None, despite: bool = False) -> Diagnosis:
    """
    Say where a twin departs from its rig, which effect is missing and how far the gap shrinks.

    ``without`` names mechanisms that are left out of the hypotheses; ``tick(stage, share)``
    reports progress; ``reach`` widens what the next experiment may do (travel rad, speed rad/s,
    torque N m, amplitude V). Raises checks.CannotDiagnose with a sentence for recordings that
    cannot be judged, and for red findings of the check of the data, unless ``despite`` them;
    ValueError for a reach that is none and a name in ``without`` that no effect has.
    """
    check_reach(reach or {})
    check_without(without, servo)
    stages = Stages(tick)
    stages.begin('check')
    parts, findings, warnings = _checked(recordings, accepting, reporting, servo, despite)
    stages.begin('residuals')
    samples = residual_samples(selecting(parts, bool(accepting)), servo)
    if not len(samples.base):
        raise CannotDiagnose(f'{servo.name}: no equation can be evaluated on these recordings; '
                             'nothing moves for long enough, or channels are missing')
    stages.begin('selection')
    found = explained(samples, without, stages.share)
    stages.begin('confidence')
    contest = Contest(*preferred(found)).slim()
    stages.begin('stability')
    several = halves(contest.found)
    stages.begin('refit')
    try:
        begin = cache(partial(begun, servo, parts, bool(accepting)))
        handed = contest.decided(lambda one, rivals, tick: handed_in(
            one, rivals, several, begin, without, tick), stages.share)
        stages.begin('comparison')
        evidence = _compared(servo, handed, several)
    except Diverged as problem:
        raise CannotDiagnose(str(problem)) from None
    stages.begin('next experiment')
    following = next_experiment(evidence, reach or {})
    stages.end()
    report = replace(
        report_of(evidence, following, [*warnings, *evidence.handover.warnings], stages.seconds),
        findings=tuple(asdict(one) for one in findings),
        defaults=tuple(asdict(one) for one in defaults(servo)))
    augmented = servo if evidence.worse else evidence.handover.patch
    return Diagnosis(report, augmented, evidence.refit, evidence)


def _checked(recordings: Sequence[Recording], accepting: Sequence[Recording],
             reporting: Sequence[Recording], servo: Servo, despite: bool
             ) -> tuple[Split, tuple[Said, ...], list[str]]:
    """
    Return the recordings by purpose, what the check says of them, and what is to be said.

    Recordings that alone contradict the servo file are left out while they are fewer than the
    others. Raises CannotDiagnose where all do.
    """
    given: list[Sequence[Recording]] = [recordings, accepting, reporting]
    left_out: list[str] = []
    while True:
        parts, judged, warnings = _parted(given[0], given[1], given[2], servo)
        findings = check_data(judged, servo)
        red = [one for one in findings if one.level == 'red']
        if not red or despite:
            split_says = replicates(judged) if parts.warnings else []
            said = [one.sentence for one in findings
                    if one.level != 'green' and one not in split_says]
            return parts, findings, [*left_out, *dict.fromkeys([*warnings, *said])]
        apart = {one.recording for one in red}
        if '' in apart or len(apart) >= EVEN * len(judged):
            raise CannotDiagnose(refusal(red))
        left_out += [f'{one.sentence} {one.recording} is left out.' for one in red]
        given = [[one for one in some if one.name not in apart] for some in given]


def _parted(recordings: Sequence[Recording], accepting: Sequence[Recording],
            reporting: Sequence[Recording], servo: Servo
            ) -> tuple[Split, list[Recording], list[str]]:
    """
    Return the recordings by purpose, all that are judged, and what is to be said of them.

    One that cannot be judged stops no other. Raises CannotDiagnose.
    """
    warnings, given = [], []
    for some in (recordings, accepting, reporting):
        kept, left_out = usable(list(some), servo) if some or some is recordings else ([], [])
        given.append(kept)
        warnings += left_out
    judged = [one for some in given for one in some]
    warnings += check(judged, servo)
    parts = split(*given)
    return parts, judged, [*warnings, *parts.warnings]


def _compared(servo: Servo, handed: Handed, several: Sequence[Half]) -> Evidence:
    """
    Run the twins over the report recordings, each missing effect taken out once.

    Where the new file cannot run without an effect, or at all, the file as given stands for it.
    Where the effects do worse than that file, the same effects with the other values moved within
    tolerance are tried.
    """
    handover, report = handed.handover, list(handed.begun.parts.report)
    cut, trial = Cut(), handed.begun.file.trial
    given = simulated(servo, report, cut)
    patch = _run(handover.patch, report, cut) if handover.added else given
    if handover.otherwise is not None and not _no_worse(patch, given):
        beside = _run(handover.otherwise.patch, report, cut)
        if handover.otherwise.helps and _no_worse(beside, given):
            handover, patch = handover.otherwise, beside
    same = content(handover.refit) == content(handover.patch)
    refit = patch if same else _run(handover.refit, report, cut)
    handover = replace(handover, helps=handover.helps and patch is not None,
                       refit=servo if refit is None else handover.refit)
    reported = {'given': given, 'within': _run(handover.within, report, cut) or given,
                'patch': patch or given, 'refit': refit or given}
    dropped, accepted = {}, {}
    for one in handover.added:
        rest = handover.without(one)
        known = rest is servo
        rest = as_in(rest, handover.patch)
        dropped[id(one.part)] = (None if known else _run(rest, report, cut)) or given
        first = handover.gaps['given']
        before = (None if known else trial.gap(rest)) or first
        accepted[id(one.part)] = (before.total() - handover.gaps['patch'].total()) / (
            first.total() or 1.0)
    by_part = {id(one.part): one for one in handover.added}
    findings = [replace(f, added=by_part.get(id(f.part), f.added)) for f in handed.findings]
    return Evidence(servo, handed.begun.parts, handed.found, tuple(findings), several, handover,
                    reported, dropped, accepted, handed.doubtful)


def _no_worse(one: Simulated | None, given: Simulated) -> bool:
    return one is not None and one.gap.total() <= given.gap.total()


def _run(servo: Servo, recordings: Sequence[Recording], cut: Cut) -> Simulated | None:
    """Return a twin over recordings; None where it cannot run."""
    try:
        return simulated(servo, recordings, cut)
    except Diverged:
        return None
