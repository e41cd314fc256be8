"""Angles that no shaft can have, before a twin takes them: leaps of an encoder, and lone slips."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite, isnan, nan, tau

import numpy as np

from ..physics.servo import Servo
from ..recording.joined_samples import CHANNELS, LOAD_POSITION, MOTOR_POSITION

FASTEST = 2e5
"""rad/s2 of a motor that none exceeds: the quickest small ones reach half of it."""
LEAST = 1.0
"""rad by which the motor may depart in any case; the load by that over the ratio."""
COARSE = 0.02
"""rad or m that the load may depart in any case: a count of a coarse encoder is no leap."""
STAYS = 3
"""Samples in a row that go on from each other where an encoder has leapt, and none that slipped;
no more than the least half window of the balances."""


@dataclass
class _Path:
    """Where a shaft is: its angle, its step a sample (NaN: not known), samples since then."""

    angle: float = nan
    step: float = nan
    since: int = 0

    def goes_on(self, angle: float, least: float) -> bool:
        """Whether an angle is on the path; its step may change by ``least`` in one sample."""
        if isnan(self.angle) or isnan(self.step):
            return True
        off = abs(angle - self.angle - self.step * self.since)
        return off <= 2.0 * abs(self.step) * self.since + least * self.since * self.since

    def take(self, angle: float) -> None:
        """Go on to an angle."""
        self.step = (angle - self.angle) / self.since if self.since else nan
        self.angle, self.since = angle, 0


@dataclass
class _Encoder:
    """
    One encoder: the path of its shaft, and another one that it may have leapt to.

    ``least``, rad or m, is how far the angle may depart from its speed in one sample; ``kept``
    how many samples go on on the other path.
    """

    column: int
    name: str
    least: float = LEAST
    path: _Path = field(default_factory=_Path)
    other: _Path = field(default_factory=_Path)
    kept: int = 0

    def take(self, angle: float) -> float | None:
        """Return nothing for an angle that goes on, NaN for one that does not, a leap's size."""
        self.missed(1)
        if not isfinite(angle):
            return None
        if self.path.goes_on(angle, self.least):
            self.path.take(angle)
            self.kept = 0
            return None
        if not (self.kept and self.other.goes_on(angle, self.least)):
            self.other, self.kept = _Path(), 0
        self.other.take(angle)
        self.kept += 1
        if self.kept < STAYS:
            return nan
        size = angle - self.path.angle - self.path.step * self.path.since
        self.path, self.kept = self.other, 0
        return size

    def missed(self, samples: int) -> None:
        """Note that so many samples have passed."""
        for path in (self.path, self.other):
            path.since += samples if isfinite(path.angle) else 0

    def smooth(self, column: np.ndarray) -> bool:
        """Take a column that goes on from its first to its last sample; else change nothing."""
        path = self.path
        if self.kept or path.since or not isfinite(path.step) or len(column) < 8:
            return False
        starts = np.concatenate(([path.angle], column[:-1]))
        steps = column - starts
        before = np.concatenate(([path.step], steps[:-1]))
        if not (np.abs(steps - before) <= 2.0 * np.abs(before) + self.least).all():
            return False
        path.angle, path.step = float(column[-1]), float(steps[-1])
        return True


class EncoderScreen:
    """
    Looks at the angles of motor and load, sample by sample.

    From one sample to the next a shaft goes on at its speed, up to a hard stop that throws it
    back as fast, and an acceleration of FASTEST. An angle that departs further is left out. Where
    STAYS of them go on from each other the encoder has leapt: its counter was reset or lost turns.
    ``left_out`` counts; how the samples are cut into blocks changes nothing.
    """

    def __init__(self, servo: Servo, period: float) -> None:
        self.left_out = 0
        self._period = period
        self._encoders = (_Encoder(MOTOR_POSITION, 'motor encoder'),
                          _Encoder(LOAD_POSITION, 'load encoder'))
        self.follow(servo)

    def follow(self, servo: Servo) -> None:
        """Go on with another servo; ``period`` stays."""
        motor, load = self._encoders
        motor.least = max(LEAST, FASTEST * self._period ** 2)
        load.least = max(COARSE, motor.least / abs(servo.values['mechanism.ratio']))
        self._straight = {one.column: servo.straight(CHANNELS[one.column])
                          for one in self._encoders}

    def begin(self) -> None:
        """Forget where the shafts were, as after a break."""
        for one in self._encoders:
            one.path, one.kept = _Path(), 0

    def missed(self, samples: int) -> None:
        """Note samples that did not come."""
        for one in self._encoders:
            one.missed(samples)

    def take(self, samples: np.ndarray) -> tuple[np.ndarray, dict[int, str]]:
        """
        Return samples (n, len(CHANNELS)) without what is no angle, and the leaps by their rows.

        A leap is told at the sample that proves it, by a sentence.
        """
        leaps: dict[int, str] = {}
        for one in self._encoders:
            if one.smooth(samples[:, one.column]):
                continue
            out = []
            for row, angle in enumerate(samples[:, one.column].tolist()):
                size = one.take(angle)
                if size is None:
                    continue
                if isnan(size):
                    out.append(row)
                else:
                    said = self._said(one, size)
                    leaps[row] = f'{leaps[row]}; {said}' if row in leaps else said
            if out:
                samples = samples.copy()
                samples[out, one.column] = nan
                self.left_out += len(out)
        return samples, leaps

    def _said(self, one: _Encoder, size: float) -> str:
        told = (f'{size:+.4g} m' if self._straight[one.column] else
                f'{size:+.4g} rad ({size / tau:+.4g} turns)')
        return f'the {one.name} leapt by {told}: it was reset or lost turns'
