"""The missing effects of an answer, and the files with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .answer.evidence import Finding, named_in, names_of
from .answer.row_instants import command_late, split_as_acted
from .decisions import EVEN
from .handover.added import Added, added_of
from .handover.chosen_fit import handed_over
from .handover.curves import Part
from .handover.given_file import given_file, GivenFile
from .handover.handover import Handover
from .handover.hypothesis_effects import friction_at_once, parts_of
from .mechanisms.hypothesis import Mechanism, UNKNOWN
from .residuals.added_input import added_input
from .selection.confidence import redrawn, Rival
from .selection.explain import Explained
from .selection.stability import Half, instead, share_in_place
from .splitting import Split


@dataclass(frozen=True)
class Begun:
    """
    What answers that read the command alike have in common: recordings as they acted, the file.

    ``fitting`` are the recordings of the refit.
    """

    parts: Split
    fitting: tuple[Recording, ...]
    file: GivenFile


def begun(servo: Servo, parts: Split, accepting: bool, late: float) -> Begun:
    """
    Return recordings whose command acts ``late`` sample periods after its row, with the file.

    ``accepting``: recordings were named to accept. Raises simulated_gap.Diverged.
    """
    parts = split_as_acted(parts, late)
    chosen = selecting(parts, accepting)
    accept = list(parts.accept) or chosen
    fitting = [one for one in chosen if all(one is not other for other in accept)] or chosen
    return Begun(parts, tuple(fitting), given_file(servo, fitting, accept))


@dataclass(frozen=True)
class Handed:
    """
    An answer with its missing effects in files; ``begun`` has the recordings as they acted.

    ``doubtful`` are effects that are not told: too few halves of the recordings name them.
    """

    found: Explained
    findings: tuple[Finding, ...]
    begun: Begun
    handover: Handover
    doubtful: tuple[Finding, ...]


def handed_in(found: Explained, known: Mapping[int, tuple[float, list[Rival]]],
              several: Sequence[Half], begin: Callable[[float], Begun],
              without: Sequence[str], tick: Callable[[float], None]) -> Handed:
    """
    Return an answer with the files; raises simulated_gap.Diverged.

    ``known`` is by member how sure it is, and its rivals; ``several`` what halves of the
    recordings say; ``begin`` returns what is begun with, by how late the command acts. ``without``
    names mechanisms that are left out.
    """
    named = _named(found, known, without)
    acting = [replace(one, added=replace(added, evidence=_evidence(found, named, one)))
              for one, added in zip(named, added_of(found, [one.part for one in named]),
                                    strict=True)]
    acting.sort(key=lambda one: -one.added.evidence)
    acting = [_waved(one, found) for one in acting]
    doubtful = _doubtful(found, several, acting)
    acting = [one for one in acting if one not in doubtful]
    acting = [replace(one, instead=_instead(found, several, one, acting)) for one in acting]
    first = begin(command_late(found))
    handover = handed_over(first.file, [one.added for one in acting], first.fitting,
                           found.within_tolerance(), tick)
    return Handed(found, tuple(acting), first, handover, doubtful)


def _instead(found: Explained, several: Sequence[Half], one: Finding, all_of: Sequence[Finding]
             ) -> tuple[tuple[Mechanism, float], ...]:
    """
    Return what halves of the recordings name in the place of a finding that few of them name.

    Where most name it, the others had too little: all recordings together tell the two apart.
    """
    if named_in(found, several, one) > EVEN:
        return ()
    return tuple(instead(several, names_of(found, one), _beside(found, one, all_of)))


def _beside(found: Explained, one: Finding, all_of: Sequence[Finding]) -> list[Mechanism]:
    """Return the names of the other findings."""
    return [name for other in all_of if other is not one for name in names_of(found, other)]


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


def _doubtful(found: Explained, several: Sequence[Half], acting: Sequence[Finding]
              ) -> tuple[Finding, ...]:
    """
    Return the findings that come and go with the recordings, so that they are not told.

    Beside the first effect of the plant another is told where every second half of the recordings
    has something in its place too (stability selection: Meinshausen, Buehlmann 2010): a half that
    gives it another name doubts the name. No simulation judges what the loop does, so a controller
    needs that in any case, and an equation that is certainly off.
    """
    def there(one: Finding) -> float:
        return share_in_place(several, names_of(found, one), _beside(found, one, acting))

    plant = [one for one in acting if one.part.mechanism.site != 'controller']
    first = next((one for one in plant if one.part.mechanism.name != UNKNOWN), None)
    return tuple(one for one in acting if one is not first and (
        there(one) < EVEN and one.part.mechanism.name != UNKNOWN
        or one not in plant and 'controller' not in found.search.off))
