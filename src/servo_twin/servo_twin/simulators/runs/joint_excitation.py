"""What both are run over when a servo is compared with the joint of a simulator."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, inf, pi, sin, sqrt

import numpy as np

from ..joint import Joint, ModelError

SLOW, FAST = 1.0, 3.4  # the two tones of each excitation, as multiples of the frequency
LEAST, MOST = 10, 10_000_000  # samples of a run
_SHARES = 0.8, 0.2  # and their shares of the amplitude


@dataclass(frozen=True)
class Excitation:
    """
    A motion or a command that is played from rest.

    ``kind`` is `position` (rad), `velocity` (rad/s) or `command` (V); two tones of
    ``frequency`` (Hz) and 3.4 times that, together ``amplitude`` high, for ``duration`` (s), one
    sample every ``period`` (s), from the angle ``start`` (rad) on. Both fade in over the first
    period of the slower one, so that neither a reference nor its speed jumps.
    """

    kind: str
    amplitude: float
    frequency: float
    duration: float
    period: float
    start: float = 0.0

    def __post_init__(self) -> None:
        if not LEAST <= self.duration / self.period <= MOST:
            raise ModelError(f'a run of {self.duration:g} s has {self.duration / self.period:.3g} '
                             f'samples of {self.period:g} s; it must have {LEAST} to {MOST:.0e}: '
                             f'choose --duration, --frequency and --timestep by that')
        if not self.frequency * FAST < 0.5 / self.period:
            raise ModelError(f'--frequency {self.frequency:g} Hz: samples of {self.period:g} s '
                             f'do not show {FAST:g} times that; choose less than '
                             f'{0.5 / self.period / FAST:.3g} Hz')

    @property
    def time(self) -> np.ndarray:
        """Instants of the samples, s."""
        return np.arange(round(self.duration / self.period)) * self.period

    def wave(self) -> np.ndarray:
        """Return the course, in the unit of its kind."""
        return self._fade()[0] * self._tones(np.sin, 0)

    def slope(self) -> np.ndarray:
        """Return the derivative of the course by time."""
        fade, growth = self._fade()
        return fade * self._tones(np.cos, 1) + growth * self._tones(np.sin, 0)

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns that it gives a servo."""
        if self.kind == 'command':
            return {'voltage': self.wave()}
        if self.kind == 'velocity':
            return {'reference_velocity': self.wave()}
        return {'reference_position': self.start + self.wave(), 'reference_velocity': self.slope()}

    def said(self, unit: str) -> str:
        """Return what it is, for a report; ``unit`` of the joint's angle."""
        of = {'position': f'of the reference position, {self.amplitude:.4g} {unit}',
              'velocity': f'of the reference speed, {self.amplitude:.4g} {unit}/s',
              'command': f'of the command, {self.amplitude:.4g} V'}[self.kind]
        first, second = self.frequency * SLOW, self.frequency * FAST
        return (f'{self.duration:.3g} s of two tones ({first:.3g} and {second:.3g} Hz) {of} in '
                f'all, which fade in, from rest at {self.start:.4g} {unit}, one sample every '
                f'{self.period:g} s')

    def _fade(self) -> tuple[np.ndarray, np.ndarray]:
        """Return how far the tones have come, from 0 to 1, and its derivative by time."""
        t, rate = self.time, pi * self.frequency
        rising = t * self.frequency < 1.0
        return (np.where(rising, 0.5 - 0.5 * np.cos(rate * t), 1.0),
                np.where(rising, 0.5 * rate * np.sin(rate * t), 0.0))

    def _tones(self, tone, derivative: int) -> np.ndarray:
        t, course = self.time, 0.0
        for share, multiple in zip(_SHARES, (SLOW, FAST), strict=True):
            rate = 2.0 * pi * self.frequency * multiple
            course = course + share * self.amplitude * rate**derivative * tone(rate * t)
        return course


def excitation_for(joint: Joint, period: float, amplitude: float | None = None,
                   frequency: float | None = None, duration: float | None = None) -> Excitation:
    """
    Return an excitation that moves a joint to and fro, several times through standstill.

    What is given stands. The rest follows from the joint: half a radian (5 cm) where it has a
    controller; else a command that is twice what friction and gravity take, and the frequency at
    which that moves it by so much.
    """
    travel = 0.05 if joint.slides else 0.5
    if joint.controlled:
        kind = 'position' if joint.kp else 'velocity'
        frequency = frequency or 0.5
        fitting = travel * (1.0 if joint.kp else 2.0 * pi * frequency)
        return Excitation(kind, amplitude or fitting, frequency, duration or 5.0 / frequency,
                          period)
    start = _hanging(joint)
    weight = hypot(joint.cosine, joint.sine) * (0.0 if joint.slides else sin(min(travel, 1.5)))
    mass = joint.inertia + joint.armature
    least = 2.0 * (joint.friction + weight + joint.stiffness * travel)
    least = least or mass * (2.0 * pi) ** 2 * travel
    unit = abs(joint.gain) or 1.0
    most = min(joint.command_limit, joint.torque_limit / unit)
    amplitude = amplitude or min(least / unit, 0.9 * most if most < inf else inf)
    drag = joint.damping + joint.back_emf
    torque = 0.5 * amplitude * unit
    if frequency is None:
        # |q| = torque / (w sqrt((J w)^2 + b^2)) = travel, solved for w^2
        square = (sqrt(drag**4 + 4.0 * (mass * torque / travel) ** 2) - drag**2) / (2.0 * mass**2)
        frequency = min(max(sqrt(square) / (2.0 * pi), 0.05), 0.02 / period)
    return Excitation('command', amplitude, frequency, duration or 5.0 / frequency, period, start)


def _hanging(joint: Joint) -> float:
    """Return the angle at which gravity and spring hold the joint without a command, rad."""
    if joint.slides:
        return joint.rest + joint.cosine / joint.stiffness if joint.stiffness else 0.0
    if not joint.stiffness:
        # c cos q + s sin q vanishes there and pulls back
        return atan2(joint.cosine, -joint.sine) if hypot(joint.cosine, joint.sine) else 0.0
    angle = joint.rest
    for _ in range(50):
        pull = joint.cosine * cos(angle) + joint.sine * sin(angle)
        slope = -joint.cosine * sin(angle) + joint.sine * cos(angle)
        off = pull - joint.stiffness * (angle - joint.rest)
        angle -= off / min(slope - joint.stiffness, -1e-9 - 0.1 * joint.stiffness)
    return angle
