"""Everything that an answer is read off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from servo_twin.physics.servo import Servo

from ..handover.added import Added
from ..handover.curves import Part
from ..handover.handover import Handover
from ..handover.simulated_gap import Simulated
from ..mechanisms.hypothesis import Mechanism, UNKNOWN
from ..residuals.added_input import AddedInput
from ..selection.confidence import Rival
from ..selection.explain import Explained
from ..selection.stability import Half, share_of
from ..splitting import Split


@dataclass(frozen=True)
class Finding:
    """
    A missing effect of the answer: its part, its confidence and rivals, what is added.

    ``instead`` is what halves of the recordings that do not name it name in its place.
    ``beaten`` are rivals by the equations that the simulation speaks against.
    ``wave`` is what somebody adds behind the controller, where that is what its equation shows.
    """

    part: Part
    confidence: float
    rivals: tuple[Rival, ...]
    added: Added
    wave: AddedInput | None = None
    instead: tuple[tuple[Mechanism, float], ...] = ()
    beaten: tuple[Mechanism, ...] = ()


def names_of(found: Explained, one: Finding) -> list[Mechanism]:
    """Return a finding, what it is a part of, and its rivals by the equations."""
    return [one.part.mechanism, found.hypotheses[one.part.number].mechanism, *one.beaten,
            *(rival.mechanism for rival in one.rivals)]


def named_in(found: Explained, halves: Sequence[Half], one: Finding) -> float:
    """
    Return in how many of the halves a finding came out.

    By its own name, by that of the hypothesis that it is a part of, or by that of a rival: what
    these recordings do not tell apart, its confidence says already.
    """
    return share_of(halves, *names_of(found, one))


@dataclass(frozen=True)
class Evidence:
    """
    Everything that the answer is read off.

    ``reported`` are the twins over the report recordings: given, within tolerances, patch, refit.
    ``dropped`` is the patch without the effect of one part (by its id), ``accepted`` what that
    costs on the accept recordings, as a share of the gap as given. ``doubtful`` are findings that
    too few halves of the recordings name.
    """

    servo: Servo
    split: Split
    found: Explained
    findings: tuple[Finding, ...]
    halves: Sequence[Half]
    handover: Handover
    reported: Mapping[str, Simulated]
    dropped: Mapping[int, Simulated]
    accepted: Mapping[int, float]
    doubtful: tuple[Finding, ...] = ()

    @property
    def named(self) -> list[Finding]:
        """
        The missing effects that have a name and stand the comparison.

        The plant's come first, by what the equations lose without them.
        """
        taken = {id(one.part) for one in self.handover.added}
        several = [one for one in self.findings
                   if id(one.part) in taken and one.part.mechanism.name != UNKNOWN]
        return sorted(several, key=lambda one: one.part.mechanism.outside)

    @property
    def worse(self) -> bool:
        """Whether what was added does no good on unseen recordings: the file stays as given."""
        patch, given = (self.reported[name].gap.total() for name in ('patch', 'given'))
        return not self.handover.helps or patch > given

    @property
    def handed(self) -> Simulated:
        """The twin of the servo file that is handed over, over the report recordings."""
        return self.reported['given' if self.worse else 'patch']

    @property
    def refit(self) -> Servo:
        """The servo with values moved within tolerance as well, where that does no worse."""
        moved, given = (self.reported[name].gap.total() for name in ('refit', 'given'))
        return self.handover.refit if moved <= given else self.servo

    @property
    def unnamed(self) -> list[Finding]:
        """Patterns that no mechanism of the list has."""
        return [one for one in self.findings if one.part.mechanism.name == UNKNOWN]
