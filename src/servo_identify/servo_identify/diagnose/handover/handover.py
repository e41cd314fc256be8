"""What a diagnosis hands over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from servo_twin.physics.servo import Servo

from ...fit.estimate import Estimate
from .added import Added
from .gap import Gap
from .trial import built


@dataclass(frozen=True)
class Handover:
    """
    The missing effects and the files with them.

    ``added`` the missing effects that stand the comparison; ``patch`` the servo as given with
    them; ``refit`` with values within tolerance moved as well; ``within`` the servo as given with
    those moved alone. ``base`` is what the patch adds to: the servo as given or, where its values
    are so far off that no addition does any good, with these moved within tolerance. ``joint`` is
    the estimate behind ``refit``, ``helps`` whether what is added brings the simulation nearer on
    the accept recordings, ``gaps`` the errors there by name;
    ``warnings`` what is to be said; ``chosen`` the standard deviations of the values in ``patch``
    by name, where a fit gave them; ``otherwise`` the same effects with the other values moved too,
    for where what stands here does worse than the file as given.
    """

    servo: Servo
    base: Servo
    added: tuple[Added, ...]
    patch: Servo
    refit: Servo
    within: Servo
    joint: Estimate | None
    helps: bool
    gaps: Mapping[str, Gap]
    warnings: tuple[str, ...]
    chosen: Mapping[str, float] = field(default_factory=dict)
    otherwise: Handover | None = None

    def without(self, one: Added) -> Servo:
        """Return the patch without one of its effects, its base where others need it."""
        others = [other for other in self.added if other is not one]
        return (built(self.base, others) if others else None) or self.base
