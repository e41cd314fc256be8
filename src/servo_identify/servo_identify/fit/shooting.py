"""
Simulated trajectories that restart from measured states, and their derivatives.

Some numbers a horizon stay unknown: how far angle, speed, torsion and rate of torsion at its start
are from what encoders and filters say (:data:`OFFSETS`); and one a recording: the zero between its
two encoders. They are estimated along and eliminated, so that they neither bias nor flatter the
parameters, and so that a horizon may begin in the middle of a ringing step.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from os import cpu_count

import numpy as np

from servo_twin.physics import state
from servo_twin.physics.kernel import fresh_state, kernel_of
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import led, substeps_of

from .segments import CHANNELS, Course

OFFSETS = ('angle', 'speed', 'wind_up', 'wind_up_rate')
"""Unknowns of a start, rad and rad/s at the load; a rigid mechanism has the first two only."""

KEPT = 4  # rollouts: that of a point and of the trials of a step

_DIRECTIONS = ((state.MOTOR_DIRECTION, state.MOTOR_REVERSAL, state.MOTOR_ANGLE, state.MOTOR_SPEED),
               (state.LOAD_DIRECTION, state.LOAD_REVERSAL, state.LOAD_ANGLE, state.LOAD_SPEED))


@dataclass(frozen=True)
class Unknowns:
    """
    Everything that is estimated.

    ``theta`` the flat vector; ``starts`` (horizons of all recordings, offsets) as
    :data:`OFFSETS`; ``zeros`` (recordings,) rad at the load; ``delays``
    (channels,) s by which a reading comes late.
    """

    theta: np.ndarray
    starts: np.ndarray
    zeros: np.ndarray
    delays: np.ndarray

    @property
    def key(self) -> tuple[bytes, ...]:
        """What tells these values from others."""
        return tuple(x.tobytes() for x in (self.theta, self.starts, self.zeros, self.delays))


class Shooting:
    """The rollouts of one servo over its courses."""

    def __init__(self, servo: Servo, courses: Sequence[Course], mode: str,
                 on: np.ndarray | None = None) -> None:
        self.servo, self.courses, self.mode = servo, tuple(courses), mode
        self.on = servo.switches if on is None else np.asarray(on, dtype=bool)
        self.kernel = kernel_of(servo)
        self.ratio = servo.slots()['mechanism.ratio'].start
        self.both = np.array([np.isfinite(c.begin[:, :2]).all() for c in self.courses])
        self.horizons = sum(len(c.starts) for c in self.courses)
        firsts = np.cumsum([0] + [len(c.starts) for c in self.courses])
        self.firsts = firsts[:-1]
        self.offsets = len(OFFSETS) if servo.mechanism.compliant else 2
        self.threads = cpu_count() or 1
        self.pool = ThreadPoolExecutor(self.threads)
        self._rolled: dict[tuple[bytes, ...] | None, list[np.ndarray]] = {}

    def beginning(self, theta: np.ndarray) -> Unknowns:
        """Return the unknowns to start from: no offsets, zeros as the readings have them."""
        zeros = np.zeros(len(self.courses))
        for i, course in enumerate(self.courses):
            if self.both[i]:
                zeros[i] = np.median([self._zero(theta, row) for row in course.begin])
        return Unknowns(theta, np.zeros((self.horizons, self.offsets)), zeros,
                        np.zeros(len(CHANNELS)))

    def _zero(self, theta: np.ndarray, row: np.ndarray) -> float:
        x = fresh_state(self.kernel)
        self._place(x, row, theta[self.ratio], True)
        self.kernel.align(theta, self.on, x, _finite(row[4]))
        return x[state.ZERO]

    def _place(self, x: np.ndarray, row: np.ndarray, ratio: float, first: bool,
               angle: float = 0.0, speed: float = 0.0) -> None:
        motor, load, motor_speed, load_speed = row[:4]
        if np.isnan(motor):
            motor, motor_speed = load * ratio, load_speed * ratio
        if np.isnan(load):
            load, load_speed = motor / ratio, motor_speed / ratio
        x[state.MOTOR_ANGLE], x[state.LOAD_ANGLE] = motor + angle * ratio, load + angle
        x[state.MOTOR_SPEED], x[state.LOAD_SPEED] = motor_speed + speed * ratio, load_speed + speed
        if first:
            for direction, reversal, at, rate in _DIRECTIONS:
                x[direction] = -1.0 if x[rate] < 0.0 else 1.0
                x[reversal] = x[at]
        if np.isfinite(row[5]):
            x[state.CURRENT] = row[5]

    def _start(self, x: np.ndarray, theta: np.ndarray, which: int, h: int, first: bool,
               zero: float, offset: np.ndarray) -> None:
        """Set the measured part of the state at the start of a horizon; keep all memories."""
        course, ratio = self.courses[which], theta[self.ratio]
        row = course.begin[h]
        self._place(x, row, ratio, first, offset[0], offset[1])
        x[state.TIME] = course.starts[h] * course.period
        torque = _finite(row[4], x[state.TORQUE])
        if first:  # memories of effects begin with the torque; later they are carried on
            self.kernel.align(theta, self.on, x, torque)
        if not self.both[which]:
            x[state.ZERO] = self._aligned(theta, x, torque)
            x[state.TORQUE] = torque
        elif self.servo.mechanism.compliant and np.isfinite(row[4]):
            # the torque sensor knows the torsion better than two encoders and a stiff mesh do
            small = 3.0 * _finite(course.noise[2])
            flanks = []
            for carried in (min(torque, -small) if torque < -small else -small,
                            max(torque, small) if torque > small else small):
                flanks.append(self._aligned(theta, x, carried))
            if torque > small:
                shift = zero - flanks[1]
            elif torque < -small:
                shift = zero - flanks[0]
            else:
                shift = zero - min(max(zero, flanks[1]), flanks[0])
            x[state.MOTOR_ANGLE] += shift * ratio
        if self.both[which]:
            x[state.ZERO], x[state.TORQUE] = zero, torque
        if self.offsets > 2:
            x[state.MOTOR_ANGLE] += offset[2] * ratio
            x[state.MOTOR_SPEED] += offset[3] * ratio

    def _aligned(self, theta: np.ndarray, x: np.ndarray, torque: float) -> float:
        """Return the zero with which the state would carry a torque, leaving its memories."""
        scratch = x.copy()
        self.kernel.align(theta, self.on, scratch, torque)
        return scratch[state.ZERO]

    def compliance(self, torque: float = 1.0) -> float:
        """Return the torsion that one more N m costs, rad at the load."""
        zeros = []
        for carried in (torque, 2.0 * torque):
            x = fresh_state(self.kernel)
            self.kernel.align(self.servo.theta, self.on, x, carried)
            zeros.append(x[state.ZERO])
        return abs(zeros[0] - zeros[1]) / torque

    def _roll(self, which: int, unknowns: Unknowns, only: np.ndarray | None) -> np.ndarray:
        course = self.courses[which]
        substeps, step = substeps_of(self.servo, course.period)
        y = np.full((len(course.recording), len(CHANNELS)), np.nan)
        x = fresh_state(self.kernel)
        mode, first = state.MODES[self.mode], True
        theta = led(self.servo, unknowns.theta, self.mode)
        for h, (a, b) in enumerate(zip(course.starts, course.stops, strict=True)):
            if only is not None and not only[self.firsts[which] + h]:
                first = True
                continue
            self._start(x, unknowns.theta, which, h, first, unknowns.zeros[which],
                        unknowns.starts[self.firsts[which] + h])
            first = False
            self.kernel.run(theta, self.on, x, course.inputs[a:b], y[a:b], substeps, step, mode)
            if not np.isfinite(x).all():
                y[a:] = np.nan
                break
        for c in np.flatnonzero(unknowns.delays):
            late = unknowns.delays[c] / course.period
            for a, b in zip(course.starts, course.stops, strict=True):
                grid = np.arange(b - a, dtype=float)
                y[a:b, c] = np.interp(grid - late, grid, y[a:b, c])
        return y

    def simulate(self, several: Sequence[Unknowns],
                 only: np.ndarray | None = None) -> list[list[np.ndarray]]:
        """
        Roll several unknowns over all courses: one list of (samples, channels) for each.

        ``only`` (horizons,) names those to roll; the others are NaN. What was rolled in the last
        few calls, as a point or a trial of a step, is not rolled again.
        """
        keys = [None if only is not None else one.key for one in several]
        fresh = [one for one, key in zip(several, keys, strict=True) if key not in self._rolled]
        jobs = [(i, u) for u in fresh for i in range(len(self.courses))]
        done = list(self.pool.map(lambda job: self._roll(*job, only), jobs))
        size = len(self.courses)
        rolled = (done[k * size:(k + 1) * size] for k in range(len(fresh)))
        answer = [self._rolled[key] if key in self._rolled else next(rolled) for key in keys]
        for key, y in zip(keys[:KEPT], answer, strict=False):
            if key is not None:
                self._rolled.pop(key, None)
                self._rolled[key] = y
        for key in list(self._rolled)[:-KEPT]:
            del self._rolled[key]
        return answer

    def stacked(self, columns: Sequence[np.ndarray]) -> np.ndarray:
        """Put what the horizons hold of each course below each other, (rows, channels)."""
        return np.concatenate([y[a:b] for y, course in zip(columns, self.courses, strict=True)
                               for a, b in zip(course.starts, course.stops, strict=True)])

    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the first row of each horizon and the recording it is of."""
        sizes = np.concatenate([c.stops - c.starts for c in self.courses])
        owner = np.repeat(np.arange(len(self.courses)), [len(c.starts) for c in self.courses])
        return np.concatenate([[0], np.cumsum(sizes)[:-1]]), owner

    def close(self) -> None:
        """End the threads."""
        self.pool.shutdown()


def moved(unknowns: Unknowns, index: int, by: float) -> Unknowns:
    """Return the unknowns with one number of `theta` moved."""
    theta = unknowns.theta.copy()
    theta[index] += by
    return replace(unknowns, theta=theta)


def _finite(value: float, otherwise: float = 0.0) -> float:
    return float(value) if np.isfinite(value) else float(otherwise)
