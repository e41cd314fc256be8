"""How large things are on this machine: speeds, torques, travels, commands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..residuals.samples import ResidualSamples

TOP = 98.0  # percentile that stands for the largest value, so that an outlier does not
SLOW = 2.0  # percentile of the speeds of a moving shaft that stands for the lowest
FADING = (2.0, 0.1)  # widths of the test function, share of the longest recording


@dataclass(frozen=True)
class Scales:
    """What the recordings reached, each quantity at its own shaft."""

    samples: ResidualSamples

    def top(self, name: str) -> float:
        """Largest size of a column of the motion that is no outlier; 0 where it is not there."""
        sizes = [np.abs(one.motion[name]) for one in self.samples.errors]
        tops = [np.nanpercentile(size, TOP) for size in sizes if np.isfinite(size).any()]
        return float(max(tops, default=0.0))

    def slowest(self, name: str) -> float:
        """Lowest speed at which a shaft was seen moving."""
        several = []
        for one in self.samples.errors:
            speed = np.abs(one.motion[name])
            top = np.nanmax(speed, initial=0.0)
            several.append(speed[speed > 0.003 * top])
        speed = np.concatenate(several)
        return float(np.percentile(speed, SLOW)) if len(speed) else 0.0

    def finest(self, site: str) -> float:
        """Least travel of a shaft, rad, that its equation tells from none: that of a knot."""
        return self.slowest(f'{site}_speed') * max(
            one.measured.shafts.spacing * one.measured.period for one in self.samples.errors)

    def travel(self, name: str) -> tuple[float, float]:
        """Lowest and highest angle of a shaft, rad."""
        angles = [one.motion[name] for one in self.samples.errors]
        return float(min(a.min() for a in angles)), float(max(a.max() for a in angles))

    def most_waves(self, angle: str) -> float:
        """
        Most waves a turn of ``angle`` that its encoder tells: one over two of its counts.

        Of shorter ones rounding to counts is the first. Infinite where it is not in counts.
        """
        ratio = self.samples.servo.numbers['mechanism.ratio']
        count = 0.0
        for one in self.samples.errors:
            motor, load = (one.measured.counts[f'{shaft}_position'] for shaft in ('motor', 'load'))
            own = (motor or load * ratio) if angle == 'motor_angle' else (load or motor / ratio)
            count = max(count, own)
        return float(np.pi / count) if count else np.inf

    def stroke(self, name: str) -> float:
        """Largest travel of a shaft in a recording, rad."""
        return max(float(np.ptp(one.motion[name])) for one in self.samples.errors)

    @cached_property
    def duration(self) -> float:
        """Longest recording, s."""
        return max(one.measured.recording.duration for one in self.samples.errors)

    @cached_property
    def period(self) -> float:
        """Longest sample period, s."""
        return max(one.measured.period for one in self.samples.errors)

    @cached_property
    def fading(self) -> tuple[float, float]:
        """
        Shortest and longest time, s, in which a force can be seen to fade.

        Between those that tell it from a damper and from a spring that stays.
        """
        shortest = max(one.motion.test.reach * one.measured.period for one in self.samples.errors)
        return FADING[0] * shortest, FADING[1] * self.duration

    @cached_property
    def command(self) -> float:
        """Largest command that is no outlier, V."""
        tops = [np.nanpercentile(np.abs(one.measured.column('voltage', 0.0)), 99.5)
                for one in self.samples.errors]
        return float(max(tops, default=0.0))

    @cached_property
    def torques(self) -> list[np.ndarray]:
        """Torque that twists the transmission, of each recording at the inner samples, N m."""
        return [one.transmitted() for one in self.samples.errors]

    @cached_property
    def torque(self) -> float:
        """Largest torque on the transmission that is no outlier, N m."""
        return self._top(self.torques)

    @cached_property
    def loads(self) -> list[np.ndarray]:
        """Torque that the motion asks for at the load, of each recording, N m."""
        return [one.predicted_load for one in self.samples.errors]

    @cached_property
    def load(self) -> float:
        """Largest torque that the motion asks for, N m."""
        return self._top(self.loads)

    @cached_property
    def currents(self) -> list[np.ndarray]:
        """Current that the motion asks for, of each recording at the inner samples, A."""
        return [one.predicted_current for one in self.samples.errors]

    @cached_property
    def current(self) -> float:
        """Largest current that the motion asks for, A."""
        return self._top(self.currents)

    def _top(self, several: list[np.ndarray]) -> float:
        return float(max((np.nanpercentile(np.abs(x), TOP) for x in several
                          if np.isfinite(x).any()), default=0.0))
