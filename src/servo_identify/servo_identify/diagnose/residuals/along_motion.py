"""A servo's models along what was measured, see :mod:`servo_twin.physics.motion_evaluation`."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from servo_twin.physics.kernel import fresh_state, kernel_of
from servo_twin.physics.motion_evaluation import EVALUATED, MOTION
from servo_twin.physics.servo import Servo

from .loop_output import commanded, integral_at_start
from .measured import Measured
from .motion import bridged, Motion, motion_of, shifted
from .shown_current import drive_current, moving_between, there_and_around
from .test_function import TestFunction

SENSOR_ROUNDS = 3  # a sensor effect is small against its reading: three rounds invert it
CROSSING = 3.0  # standard deviations of a torque within which its sign is not known
UNLOADED, INFERRED = 0.02, 0.3  # likewise, as a share of the torque at work: measured, inferred


@dataclass
class AlongMotion:
    """One recording and the models of a servo along its motion."""

    servo: Servo
    measured: Measured
    shift: np.ndarray | float = 0.0
    """Torque on the load (N m, at every sample) by which that of the sensor or twin is off."""

    unseen: dict[str, np.ndarray] = field(default_factory=dict)
    """What an explanation adds to the signals motor_torque and load_torque, at every sample."""

    slots: dict[str, slice] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.slots = self.servo.slots()
        self._kernel = kernel_of(self.servo)
        self._projected: dict[Hashable, Any] = {}
        self._sensing = np.array([p.effect.port == 'sensor' and p.effect.candidate
                                  for p in self.servo.effects], dtype=bool)
        self._readings = self._corrected(self.servo.theta)
        self.motion, self.gear_motion = self._motions(self._readings)

    def times(self, equation: str) -> np.ndarray:
        """Instants of the residuals, s from the start of the recording."""
        return self.test(equation).centres(len(self.measured.recording)) * self.measured.period

    def test(self, equation: str) -> TestFunction:
        """Test function of an equation."""
        return self.measured.test_function(equation)

    def motion_of(self, equation: str) -> Motion:
        """Motion along which the models of an equation are evaluated."""
        return self.gear_motion if equation == 'transmission' else self.motion

    def drive_current(self, theta: np.ndarray, command: np.ndarray | None = None) -> np.ndarray:
        """Return what the drive makes of the command (or another, V), A, at every sample."""
        key = theta.tobytes() if command is None else None
        if key is not None and self._projected.get('drive key') == key:
            return self._projected['drive current']
        command = self.measured.column('voltage', 0.0) if command is None else command
        current = drive_current(self.servo, theta, command, self.fast_speed,
                                self.measured.recording)
        if self.measured.recording.has('voltage'):  # a drive without a command is off
            current[~np.isfinite(self.measured.recording['voltage'])] = np.nan
        if key is not None:
            self._projected['drive key'], self._projected['drive current'] = key, current
        return current

    def drive_current_ahead(self, time: float) -> np.ndarray:
        """Return how the current of the drive changes with the speed some time later, A."""
        command = self.measured.column('voltage', 0.0)
        speed = shifted(self.fast_speed, -time, self.measured.period)
        ahead = drive_current(self.servo, self.servo.theta, command, speed,
                              self.measured.recording)
        return ahead - self.drive_current(self.servo.theta)

    @cached_property
    def fast_speed(self) -> np.ndarray:
        """Speed of the motor for the electrical equations, rad/s, at every sample."""
        fast = self.measured.fast
        return np.pad(fast.smooth(bridged(self.angles()[0]), 1), fast.reach, mode='edge')

    def controller_output(self, theta: np.ndarray, settings: Mapping[int, float] | None = None,
                          shaken: tuple[np.ndarray, np.ndarray] | None = None,
                          held: Mapping[str, np.ndarray] | None = None) -> np.ndarray:
        """
        Return what the controller makes of ``held`` or recorded references, V, at every sample.

        ``shaken`` are the two angles where noise is added to them.
        """
        theta = theta.copy()
        for slot, change in (settings or {}).items():
            theta[slot] += change
        return commanded(self.servo, self.measured, theta, shaken or self.angles(), held or {},
                         self.integral)

    @cached_property
    def integral(self) -> float:
        """What the controller's integral begins with, V."""
        return integral_at_start(self.servo, self.measured, self.angles())

    def current_between(self) -> np.ndarray | None:
        """
        Return the mean of a winding's current around each sample, less what it is there, A.

        A held command makes it jump with its row and fade till the next. None without a winding,
        or where command or current was not recorded.
        """
        if not {'voltage', 'current'} <= self.measured.channels or (
                'drive.resistance' not in self.slots):
            return None
        there, around = there_and_around(
            self.servo, self.servo.theta, self.measured.column('voltage', 0.0), self.fast_speed,
            self.measured.recording)
        return np.nan_to_num(around - there)

    def current_moving(self) -> np.ndarray | None:
        """Return :func:`.driven_current.moving_between`; None where no winding is told by rows."""
        if not {'voltage', 'current'} <= self.measured.channels or not (
                self.servo.numbers.get('drive.inductance')):
            return None
        return moving_between(self.servo, self.measured.column('voltage', 0.0), self.fast_speed,
                              self.measured.recording)

    def current_stepped(self) -> np.ndarray | None:
        """
        Return by how much the current jumps as the drive takes a new row's references over, A.

        At every sample; None where the command was recorded, or nothing is known of the loop.
        """
        measured, has = self.measured, self.measured.recording.has
        refers = [name for name in ('reference_position', 'reference_velocity') if has(name)]
        if 'voltage' in measured.channels or 'current' not in measured.channels or not (
                refers and self.servo.controller.parameters):
            return None
        before = {name: np.concatenate((series[:1], series[:-1])) for name in refers
                  for series in [measured.column(name, 0.0)]}
        theta, loop = self.servo.theta, self.servo.theta.copy()
        if 'controller.ki' in self.slots:  # the integral of a late reference is no jump
            loop[self.slots['controller.ki'].start] = 0.0
        now, then = (self.drive_current(theta, self.controller_output(loop, held=held))
                     for held in ({}, before))
        stepped = now - then
        stepped[0] = 0.0
        return stepped

    def angles(self) -> tuple[np.ndarray, np.ndarray]:
        """Angles of both shafts, rad; where one is not measured it follows from the other."""
        return self._angles(self._readings)

    def evaluated(self, theta: np.ndarray, motion: Motion) -> np.ndarray:
        """Return what the models say along a motion: (inner samples, len(EVALUATED))."""
        rows = motion.rows
        if 'current' not in self.measured.channels:
            rows = rows.copy()
            inner = slice(motion.test.reach, motion.test.reach + len(rows))
            rows[:, MOTION.index('current')] = self.drive_current(theta)[inner]
        out = np.empty((len(rows), len(EVALUATED)))
        self._kernel.evaluate_models(theta, self.servo.switches, fresh_state(self._kernel),
                                     np.ascontiguousarray(rows), out, self.measured.period)
        return out

    def flank(self, motion: Motion) -> np.ndarray:
        """
        Return on which flank the teeth are, -1 to 1, at the inner samples of a motion.

        Between the two, within noise of the torque or a small share of the torque at work.
        """
        key = 'flank', motion.test
        if key not in self._projected:
            sensed = 'torque' in self.measured.channels
            torque = motion.calm_torque + self._shifted(motion) if sensed else (
                self.transmitted(motion))
            noise = np.nan_to_num(self.measured.noise['torque']) * motion.test.gain(0)
            work = float(np.sqrt(np.nanmean(torque**2))) if np.isfinite(torque).any() else 0.0
            share = UNLOADED if sensed else INFERRED
            unsure = max(float(np.hypot(CROSSING * noise, share * work)), 1e-12)
            self._projected[key] = np.clip(np.nan_to_num(torque) / unsure, -1.0, 1.0)
        return self._projected[key]

    def inner(self, series: np.ndarray, motion: Motion | None = None) -> np.ndarray:
        """Return a series of every sample at the inner ones of a motion."""
        motion = motion or self.motion
        reach = motion.test.reach
        return series[reach:reach + len(motion.rows)]

    def _shifted(self, motion: Motion) -> np.ndarray:
        return self.inner(np.broadcast_to(self.shift, len(self.measured.recording)), motion)

    def transmitted(self, motion: Motion | None = None) -> np.ndarray:
        """Torque on the load at the inner samples, N m: measured, or what the load takes."""
        motion = motion or self.motion
        torque = motion['torque']
        if not np.isfinite(torque).any():
            torque = self.evaluated(self.servo.theta, motion)[:, EVALUATED.index('torque')]
        return torque + self._shifted(motion)

    def full(self, series: np.ndarray, motion: Motion | None = None) -> np.ndarray:
        """Return a series of inner samples at every sample, NaN where it is not known."""
        samples = len(self.measured.recording)
        if len(series) == samples:
            return series
        reach = (motion or self.motion).test.reach
        full = np.full((samples, *series.shape[1:]), np.nan)
        full[reach:reach + len(series)] = series
        return full

    def _angles(self, readings: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        ratio, twist = self.servo.numbers['mechanism.ratio'], self.measured.twist
        motor, load = readings['motor_position'], readings['load_position']
        if not np.isfinite(motor).any():
            motor = (load + twist) * ratio
        elif not np.isfinite(load).any():
            load = motor / ratio - twist
        return motor, load

    def _motions(self, readings: Mapping[str, np.ndarray]) -> tuple[Motion, Motion]:
        measured = self.measured
        whole = motion_of(measured, measured.shafts, self.servo, self._angles(readings))
        if measured.gear == measured.shafts:
            return whole, whole
        return whole, motion_of(measured, measured.gear, self.servo, self._angles(readings))

    def _corrected(self, theta: np.ndarray) -> dict[str, np.ndarray]:
        """Return the readings with what the servo's own sensor effects do taken off."""
        names = ('motor_position', 'load_position', 'torque', 'current', 'voltage')
        recording = self.measured.recording
        if not self._sensing.any():
            return {name: recording[name] for name in names}
        rows = {name: bridged(recording[name]) for name in names[:4]}
        rows['motor_position'], rows['load_position'] = self._angles(rows)
        recorded = np.nan_to_num(np.column_stack(list(rows.values())))
        known = np.isfinite(np.column_stack([recording[name] for name in names[:4]]))
        truth, readings = recorded.copy(), np.empty_like(recorded)
        for _ in range(SENSOR_ROUNDS):
            self._kernel.sensor_readings(theta, self._sensing, fresh_state(self._kernel), truth,
                                         readings, self.measured.period)
            truth += recorded - readings
        truth = np.where(known, truth, np.nan)
        return dict(zip(names, (*truth.T, recording['voltage']), strict=True))
