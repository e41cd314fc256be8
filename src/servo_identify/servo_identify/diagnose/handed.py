"""The missing effects of an answer and the files with them, and which of two answers is nearer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from servo_twin.recording.recording import Recording

from .answer.evidence import Finding
from .answer.row_instants import command_late, split_as_acted
from .decisions import ALTERNATIVE, EVEN
from .handover.added import Added, added_of
from .handover.chosen_fit import handed_over
from .handover.curves import Part
from .handover.handover import Handover
from .handover.parts import friction_at_once, parts_of
from .handover.simulated_gap import Diverged
from .mechanisms.hypothesis import NEAREST
from .residuals.added_input import added_input
from .selection.confidence import redrawn, Rival
from .selection.explain import Explained
from .selection.stability import share_of
from .splitting import Split


@dataclass(frozen=True)
class Answer:
    """What the equations say: the set, and by member how sure it is, and its rivals."""

    found: Explained
    known: Mapping[int, tuple[float, list[Rival]]]


@dataclass(frozen=True)
class Handed:
    """An answer with its missing effects in files; ``parts`` are the recordings as they acted."""

    answer: Answer
    findings: tuple[Finding, ...]
    parts: Split
    accept: tuple[Recording, ...]
    handover: Handover


def rival_answer(found: Explained, known: Mapping[int, tuple[float, list[Rival]]]
                 ) -> Answer | None:
    """
    Return the answer with its one effect exchanged for a rival, where that is as likely, nearly.

    Of several effects a simulation shows little by itself: each hides in the others. Of a form
    that the twin has not, such as a lag of second order, it shows that of the nearest effect.
    """
    choice = found.explanation.smallest.choice
    if len(choice.members) != 1:
        return None
    (number, side), = choice.members
    confidence, rivals = known[number]
    if not rivals or rivals[0].confidence < EVEN * confidence:
        return None
    first, *others = rivals
    if any(NEAREST in found.hypotheses[one].detail for one in (number, first.number)):
        return None
    fit = found.search.fitted(choice.minus(number).plus(first.number, first.side))
    mine = Rival(number, side, found.hypotheses[number].mechanism, confidence)
    other = replace(found, explanation=replace(found.explanation, smallest=fit))
    return Answer(other, {first.number: (first.confidence, [mine, *others])})


def handed_in(answer: Answer, several: list[set[tuple[str, ...]]], parts: Split, accepting: bool,
              without: Sequence[str], tick: Callable[[float], None] = lambda share: None
              ) -> Handed:
    """
    Return an answer with the files; raises simulated_gap.Diverged.

    ``several`` is what halves of the recordings say, ``accepting``: recordings were named to
    accept. ``without`` names mechanisms that are left out.
    """
    found = answer.found
    named = _named(found, answer.known, without)
    acting = [replace(one, added=replace(added, evidence=_evidence(found, named, one)))
              for one, added in zip(named, added_of(found, [one.part for one in named]),
                                    strict=True)]
    acting.sort(key=lambda one: -one.added.evidence)
    acting = [_waved(one, found) for one in acting]
    acting = [one for one in acting if _stands(found, several, one)]
    parts = split_as_acted(parts, command_late(found))
    chosen = selecting(parts, accepting)
    accept = list(parts.accept) or chosen
    fitting = [one for one in chosen if all(one is not other for other in accept)] or chosen
    handover = handed_over(found.samples.servo, [one.added for one in acting], fitting, accept,
                           found.within_tolerance(), tick)
    return Handed(answer, tuple(acting), parts, tuple(accept), handover)


def nearer(first: Handed, rival: Answer, several: list[set[tuple[str, ...]]], parts: Split,
           accepting: bool, without: Sequence[str]) -> Handed:
    """
    Return the answer or its rival, whichever the simulation bears out, and how sure it is now.

    What the equations do not tell apart the simulation may: a lag and a delay turn the phase
    alike, and come to other angles. The evidence of both adds up, as that of an effect does.
    """
    try:
        other = handed_in(rival, several, parts, accepting, without)
    except Diverged:
        return first
    if not all(_shows(one.handover) for one in (first, other)):
        return first
    nats = other.handover.gaps['patch'].evidence(first.handover.gaps['patch'])
    (number, (mine, _)), = first.answer.known.items()
    (against, (its, _)), = rival.known.items()
    share = float(expit(nats + np.log(mine / its)))
    best, by, beside = (first, share, against) if share >= 0.5 else (other, 1.0 - share, number)
    return replace(best, findings=tuple(_shared(one, by, beside) for one in best.findings))


def _shows(handover: Handover) -> bool:
    """Tell whether a simulation has all of what is added: it has nothing outside the plant."""
    return handover.helps and bool(handover.added) and not any(
        one.part.mechanism.outside for one in handover.added)


def _shared(one: Finding, share: float, beside: int) -> Finding:
    """Return a finding that has a share of what it and one rival (by its number) have together."""
    pair = [rival for rival in one.rivals if rival.number == beside]
    both = one.confidence + sum(rival.confidence for rival in pair)
    rivals = sorted((replace(rival, confidence=(1.0 - share) * both) if rival in pair else rival
                     for rival in one.rivals), key=lambda rival: -rival.confidence)
    return replace(
        one, confidence=share * both if pair else one.confidence,
        rivals=tuple(rival for rival in rivals if rival.confidence >= ALTERNATIVE),
        excluded=tuple(rival for rival in rivals if rival.confidence < ALTERNATIVE))


def selecting(parts: Split, accepting: bool) -> list[Recording]:
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
