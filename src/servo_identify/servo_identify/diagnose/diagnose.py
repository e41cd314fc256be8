"""From recordings of one machine and its servo file to the answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace

import numpy as np
from threadpoolctl import threadpool_limits

from servo_twin.description.given_values import defaults
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ..data.check import check as check_data
from ..data.check import replicates
from ..data.finding import Finding as Said
from ..data.finding import refusal
from ..experiment.reach_limits import check_reach
from .answer.evidence import Evidence, Finding
from .answer.experiments import next_experiment
from .answer.row_instants import command_late, split_as_acted
from .answer.verdict import report_of
from .checks import CannotDiagnose, check, usable
from .decisions import EVEN
from .diagnosis import Diagnosis
from .handover.added import Added, added_of
from .handover.chosen_fit import handed_over
from .handover.curves import Part
from .handover.cut import Cut
from .handover.handover import Handover
from .handover.parts import friction_at_once, parts_of
from .handover.shortened import judging
from .handover.simulated_gap import Diverged, Simulated, simulated
from .handover.trial import content
from .residuals.added_input import added_input
from .residuals.samples import residual_samples
from .selection.confidence import preferred, redrawn, Rival
from .selection.explain import Explained, explained
from .selection.stability import halves, share_of
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
    ValueError for a reach that is none.
    """
    check_reach(reach or {})
    stages = Stages(tick)
    stages.begin('check')
    parts, findings, warnings = _checked(recordings, accepting, reporting, servo, despite)
    stages.begin('residuals')
    samples = residual_samples(_selecting(parts, bool(accepting)), servo)
    if not len(samples.base):
        raise CannotDiagnose(f'{servo.name}: no equation can be evaluated on these recordings; '
                             'nothing moves for long enough, or channels are missing')
    stages.begin('selection')
    found = explained(samples, without, stages.share)
    stages.begin('confidence')
    found, rivals = preferred(found)
    found = found.slim()
    named = _named(found, rivals, without)
    stages.begin('stability')
    several = halves(found)
    stages.begin('refit')
    acting = [replace(one, added=replace(added, evidence=_evidence(found, named, one)))
              for one, added in zip(named, added_of(found, [one.part for one in named]),
                                    strict=True)]
    acting.sort(key=lambda one: -one.added.evidence)
    acting = [_waved(one, found) for one in acting]
    acting = [one for one in acting if _stands(found, several, one)]
    parts = split_as_acted(parts, command_late(found))
    selecting = _selecting(parts, bool(accepting))
    accept = list(parts.accept) or selecting
    fitting = [one for one in selecting if all(one is not other for other in accept)] or selecting
    try:
        handover = handed_over(servo, [one.added for one in acting], fitting, accept,
                               found.within_tolerance(), stages.share)
        stages.begin('comparison')
        evidence = _compared(servo, parts, found, acting, several, handover, accept)
    except Diverged as problem:
        raise CannotDiagnose(str(problem)) from None
    stages.begin('next experiment')
    following = next_experiment(evidence, reach or {})
    stages.end()
    report = replace(
        report_of(evidence, following, [*warnings, *handover.warnings], stages.seconds),
        findings=tuple(asdict(one) for one in findings),
        defaults=tuple(asdict(one) for one in defaults(servo)))
    augmented = servo if evidence.worse else handover.patch
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


def _selecting(parts: Split, accepting: bool) -> list[Recording]:
    """Return the recordings that select, each once; ``accepting``: others were named to accept."""
    held = {id(one) for one in (*parts.report, *(parts.accept if accepting else ()))}
    pool = [one for one in (*parts.screen, *parts.accept) if id(one) not in held]
    return list({id(one): one for one in pool}.values()) or list(parts.screen)


def _named(found: Explained, known: Mapping[int, tuple[float, list[Rival]]],
           without: Sequence[str]) -> list[Finding]:
    """Return the missing effects of the chosen set, in the order in which they were found."""
    fit, several = found.explanation.smallest, []
    draws = redrawn(found, fit)
    for number in fit.choice.numbers:
        at = np.isin(fit.columns[1:], found.search.regression.members[number])
        confidence, rivals = known[number]
        for part in parts_of(found, number, draws[:, at], without):
            whole = (part.mechanism.key, _law_of(found, part))
            same = [one for one in rivals if one.mechanism.key in whole]
            sure = confidence + sum(one.confidence for one in same)  # it is a part of these
            several.append(Finding(part, sure, tuple(one for one in rivals if one not in same),
                                   Added(part)))
    known_of = {one.part.number: one for one in several}
    return [next((one for one in several if one.part is part), None)
            or replace(known_of[part.number], part=part, added=Added(part))
            for part in friction_at_once(found, [one.part for one in several], without)]


def _law_of(found: Explained, part: Part) -> tuple[str, ...]:
    """Return the law of the file that a part is a value of, and its site; empty for others."""
    path = part.path or found.hypotheses[part.number].path
    return next(((placed.effect.name, placed.site) for placed in found.samples.servo.effects
                 if path.startswith(f'effects.{placed.name}.')), ())


def _evidence(found: Explained, named: Sequence[Finding], one: Finding) -> float:
    """Return what the equations lose without an effect, nats; parts of a pattern share it."""
    fit = found.explanation.smallest
    parts = sum(other.part.number == one.part.number for other in named)
    return (found.search.fitted(fit.choice.minus(one.part.number)).total - fit.total) / parts


def _waved(one: Finding, found: Explained) -> Finding:
    """Return a finding with the wave behind the controller, where that is what it stands for."""
    told = 'told' in found.hypotheses[one.part.number].detail
    if one.part.mechanism.site != 'controller' or told:
        return one
    wave = added_input(found.samples.errors)
    return replace(one, wave=wave, added=Added(one.part)) if wave else one


def _stands(found: Explained, several: list[set[tuple[str, ...]]], one: Finding) -> bool:
    """
    Tell whether a finding is worth simulating.

    No simulation judges what the loop does, so a controller is named only where its equation is
    certainly off and most halves of the recordings say so.
    """
    if one.part.mechanism.site != 'controller':
        return True
    return 'controller' in found.search.off and share_of(several, one.part.mechanism) >= EVEN


def _compared(servo: Servo, parts: Split, found: Explained, findings: list[Finding],
              several: list[set[tuple[str, ...]]], handover: Handover,
              accept: Sequence[Recording]) -> Evidence:
    """Run the twins over the report recordings, each missing effect taken out once."""
    report = list(parts.report)
    cut, judged = Cut(), judging(accept, servo.step)
    reported = {'given': simulated(servo, report, cut),
                'within': _or(handover.within, servo, report, cut)}
    reported['patch'] = reported['given']
    if handover.added:
        reported['patch'] = simulated(handover.patch, report, cut)
    same = content(handover.refit) == content(handover.patch)
    reported['refit'] = reported['patch'] if same else _or(
        handover.refit, handover.patch, report, cut)
    dropped, accepted = {}, {}
    for one in handover.added:
        rest = handover.without(one)
        known = rest is servo
        dropped[id(one.part)] = reported['given'] if known else simulated(rest, report, cut)
        before = handover.gaps['given'] if known else simulated(rest, judged, cut).gap
        first = handover.gaps['given'].total() or 1.0
        accepted[id(one.part)] = (before.total() - handover.gaps['patch'].total()) / first
    by_part = {id(one.part): one for one in handover.added}
    findings = [replace(f, added=by_part.get(id(f.part), f.added)) for f in findings]
    return Evidence(servo, parts, found, tuple(findings), several, handover, reported,
                    dropped, accepted)


def _or(first: Servo, second: Servo, recordings: Sequence[Recording], cut: Cut) -> Simulated:
    try:
        return simulated(first, recordings, cut)
    except Diverged:
        return simulated(second, recordings, cut)
