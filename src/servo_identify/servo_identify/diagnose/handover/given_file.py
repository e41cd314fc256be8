"""The file as given over the recordings, before any effect: the same for all answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ...fit.estimate import Estimate
from .shortened import judging, shortened
from .simulated_gap import Diverged, refitted
from .trial import Trial, Tried

FITTED = ('drive', 'mechanism', 'effects')  # what a fit of the plant moves


@dataclass(frozen=True)
class GivenFile:
    """
    A servo file as given, and with its values moved within their tolerances.

    ``trial`` has the recordings that judge it and what was simulated on them; ``tolerated`` are
    the paths that a fit may move, ``within`` the fit of these alone (None where there is none),
    ``given`` the file itself, ``beside`` it with the values of ``within``.
    """

    trial: Trial
    tolerated: tuple[str, ...]
    within: Estimate | None
    given: Tried
    beside: Tried

    @property
    def servo(self) -> Servo:
        """The servo as given."""
        return self.given.base

    @property
    def moved(self) -> Servo:
        """The servo with the values within tolerance fitted alone."""
        return self.servo if self.within is None else self.within.servo


def given_file(servo: Servo, fitting: Sequence[Recording], accepting: Sequence[Recording]
               ) -> GivenFile:
    """Return a file fitted and simulated over recordings; raises Diverged."""
    trial = Trial(shortened(fitting, servo.step), judging(accepting, servo.step))
    tolerated = tuple(path for path in servo.tolerance if path.split('.')[0] in FITTED)
    within = refitted(servo, trial.fitting, tolerated, near=False)
    given = trial.of(servo)
    if given is None:
        raise Diverged(f'{servo.name}: the simulation leaves the finite numbers on the '
                       'recordings; its step may be too long')
    beside = None if within is None else trial.of(within.servo)
    return GivenFile(trial, tolerated, within, given, beside or given)
