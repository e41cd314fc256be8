"""What an experiment may not exceed: judged on its plan, then on every sample that is measured."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.straight_units import straightened

from .procedures import Run
from .usual_limits import UNITS, USUAL

REACTION = 0.03
"""Seconds from a sample to the stop taking effect; motion is judged this far ahead."""

BRAKING = 2.0
"""Deceleration, rad/s2 at the load, that is counted on for the travel of a stop."""

WINDOW = 0.02
"""Seconds over which speed is measured: longer than a swing of the mesh."""


class LimitError(ValueError):
    """A plan that would exceed a limit."""


@dataclass(frozen=True)
class Limits:
    """
    Largest sizes of speed (rad/s), transmitted torque (N m) and travel (rad), all at the load.

    ``travel`` counts from where the experiment began, to either side; ``current`` in A. A load
    that moves straight (``linear``) has m/s, N and m.
    """

    speed: float = USUAL['speed']
    torque: float = USUAL['torque']
    travel: float = USUAL['travel']
    current: float = USUAL['current']
    linear: bool = False

    def __post_init__(self) -> None:
        for name in ('speed', 'torque', 'travel', 'current'):
            if not getattr(self, name) > 0.0:
                raise LimitError(f'limit of {name} = {getattr(self, name):g}; '
                                 f'it must be positive')

    def unit(self, name: str) -> str:
        """Return the unit of a limit."""
        return straightened(UNITS[name]) if self.linear else UNITS[name]

    def check(self, run: Run, gain: float | None = None) -> None:
        """
        Raise LimitError for a run whose set-points exceed a limit.

        ``gain``, A/V, makes a current of a voltage; None: the drive does not say.
        """
        reference, sizes = run.reference, {}
        if run.mode == 'velocity':
            sizes['speed'] = reference
            sizes['travel'] = np.cumsum(reference) * run.period
        elif run.mode == 'position':
            sizes['speed'] = np.diff(reference) / run.period
            sizes['travel'] = reference
        elif run.mode == 'current':
            sizes['current'] = reference
        elif gain is not None:
            sizes['current'] = gain * reference
        sizes['torque'] = run.external_torque
        for name, values in sizes.items():
            unit = self.unit(name)
            most, limit = float(np.abs(values).max(initial=0.0)), getattr(self, name)
            if most > limit:
                raise LimitError(f'{run.name} asks for a {name} of {most:.4g} {unit}, the limit '
                                 f'is {limit:g} {unit}; choose less, or another limit')


def limits_of(servo: Servo, given: Mapping[str, float | None]) -> Limits:
    """
    Return the limits for a machine: those that are given by name, else the usual ones.

    Raises LimitError for an axis that moves straight, of which nothing is usual, where one of
    speed, torque and travel is not given.
    """
    told = {name: value for name, value in given.items() if value is not None}
    missing = [name for name in UNITS if name != 'current' and name not in told]
    if servo.linear and missing:
        raise LimitError(f'{servo.name} moves straight, and no limit is usual for it; give '
                         + ' and '.join(f'--max-{name} in {straightened(UNITS[name])}'
                                        for name in missing))
    return Limits(**told, linear=servo.linear)


class Guard:
    """
    Watches what is measured; says the first limit that is, or is about to be, exceeded.

    Samples come in order by :meth:`see`; ``origin`` is the load angle where the travel is zero.
    A reading that is NaN is not judged.
    """

    def __init__(self, limits: Limits, origin: float, period: float) -> None:
        self.limits = limits
        self.origin = self._last = origin
        self.most = {'speed': 0.0, 'torque': 0.0, 'travel': 0.0, 'current': 0.0}
        self._size = max(2, round(WINDOW / period))
        self._period = period
        self._angles: deque[float] = deque(maxlen=2 * self._size + 1)

    @property
    def angle(self) -> float:
        """Angle of the load at the last sample, rad."""
        return self._last

    @property
    def speed(self) -> float:
        """Speed of the load over the last window, rad/s; 0 before there is one."""
        if len(self._angles) <= self._size:
            return 0.0
        return (self._angles[-1] - self._angles[-1 - self._size]) / (self._size * self._period)

    def see(self, position: float = inf, torque: float = inf, current: float = inf) -> str:
        """Take what is known of a sample (inf: nothing); return what is wrong, or nothing."""
        if isfinite(position):
            self._angles.append(position)
            self._last = position
            speed = self.speed
            ahead = self._ahead(speed)
            travel = position - self.origin
            stop = travel + speed * REACTION + speed * abs(speed) / (2.0 * BRAKING)
            said = self._judge('speed', abs(speed), abs(ahead)) or self._judge(
                'travel', abs(travel), max(abs(travel), abs(stop)))
            if said:
                return said
        if isfinite(torque) and (said := self._judge('torque', abs(torque), abs(torque))):
            return said
        if isfinite(current):
            return self._judge('current', abs(current), abs(current))
        return ''

    def forget(self) -> None:
        """Begin the window of the speed again, as after samples that were lost."""
        self._angles.clear()

    def at_rest(self) -> bool:
        """Whether the load has not moved over two windows."""
        angles = self._angles
        return len(angles) == angles.maxlen and max(angles) - min(angles) < 1e-4

    def _ahead(self, speed: float) -> float:
        """Return the speed a reaction ahead; measured is that of half a window ago."""
        angles, size = self._angles, self._size
        if len(angles) <= 2 * size:
            return speed
        before = (angles[-1 - size] - angles[0]) / (size * self._period)
        if abs(speed) <= abs(before):
            return speed
        return speed + (speed - before) / (size * self._period) * (REACTION + WINDOW / 2.0)

    def _judge(self, name: str, now: float, ahead: float) -> str:
        self.most[name] = max(self.most[name], now)
        limit, unit = getattr(self.limits, name), self.limits.unit(name)
        if ahead <= limit:
            return ''
        return (f'{name}: {now:.4g} {unit} measured' + (f', {ahead:.4g} {unit} ahead' if
                ahead > now else '') + f'; the limit is {limit:g} {unit}')
