"""
The residual of every equation along what was measured, for any values and switches of a servo.

Where the servo is right, the terms of an equation sum to noise. What a missing effect would add is
a signal of the same equations: :meth:`EquationErrors.of_signal`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from servo_twin.balances.equation_terms import equation_terms, Term
from servo_twin.physics.motion_evaluation import EVALUATED
from servo_twin.physics.servo import Servo

from .asked_by_motion import AskedByMotion
from .measured import twist_of
from .motion import Motion


@dataclass
class EquationErrors(AskedByMotion):
    """The residuals of one recording, of :mod:`servo_twin.balances.equation_terms`."""

    @cached_property
    def terms(self) -> dict[str, tuple[Term, ...]]:
        """Terms of each equation at the values of the servo."""
        return self._terms(self.servo.theta)

    @property
    def equations(self) -> tuple[str, ...]:
        """Equations that the channels of this recording allow."""
        return tuple(self.terms)

    def moving(self, equation: str) -> np.ndarray:
        """Where friction is known: no rest under the test function, or a start. Else all true."""
        if equation in ('motor', 'load', 'torque'):
            return self.motion.moving() | self.motion.starting()
        if equation == 'transmission' and 'torque' not in self.measured.channels:
            return self.gear_motion.moving()
        return np.ones(len(self.times(equation)), dtype=bool)

    def covered(self, equation: str) -> np.ndarray:
        """Where the motion of the shafts is known under the whole test function: all may act."""
        known = self.full(np.zeros(len(self.motion.rows)))
        return np.isfinite(self.test(equation).project(known))

    def slope(self, path: str, step: float) -> dict[str, np.ndarray]:
        """
        Return the change of each residual for one unit of a value, over a step of it.

        Values of the drive scale the current, which is the force that the other terms explain.
        Their slope is taken at the current (and command) that the motion asks for by the file.
        """
        key = 'slope', path, step
        if key not in self._projected:  # a value that varies asks for it time and again
            self._projected[key] = self._slope(path, step)
        return self._projected[key]

    def _slope(self, path: str, step: float) -> dict[str, np.ndarray]:
        moved = self.servo.theta.copy()
        moved[self.servo.place(path)] += step
        if path.startswith('drive.'):
            return self._drive_slope(path, moved, step)
        before, after = self.nominal, self.residuals(moved)
        if path.startswith('mechanism.') and self.measured.twist.any():
            swing = self.of_signal(*self.turned(self.servo.with_values(
                {path: self.servo.number(path) + step})))
            after = {name: values + swing.get(name, 0.0) for name, values in after.items()}
        return {name: (after[name] - before[name]) / step for name in after}

    def turned(self, other: Servo, beside: bool = False) -> tuple[str, np.ndarray]:
        """
        Return the signal of the angle that is not measured, and by how much it is another.

        ``other`` is the elastic servo that turns it so, rad, (samples,), ``beside`` the torque on
        the load that was found. A friction in that is of the motion of this servo.
        """
        found = beside and self.known_beside_gap.any()
        known = self._beside if found else (0.0, self.measured.twist)
        turned = self._twisted(other, known[0]) - known[1]
        if 'motor_position' in self.measured.channels:
            return 'load_position', -turned
        return 'motor_position', turned * self.servo.numbers['mechanism.ratio']

    @cached_property
    def _beside(self) -> tuple[np.ndarray, np.ndarray]:
        """Torque on the load that was found, and the torsion of this servo under it."""
        push = np.nan_to_num(self.full(self.known_beside_gap))
        return push, self._twisted(self.servo, push)

    def _twisted(self, servo: Servo, push: np.ndarray | float) -> np.ndarray:
        return twist_of(self.measured.recording, servo, 2 * self.measured.shafts.spacing, push)

    def _drive_slope(self, path: str, moved: np.ndarray, step: float) -> dict[str, np.ndarray]:
        answer = {}
        before, after = self._terms(self.servo.theta), self._terms(moved)
        measured = 'current' in self.measured.channels
        now = self.full(self.known_current)
        later = now if measured else now + self._current_change(moved, now)
        drive = self.drive_current(moved) - self.drive_current(self.servo.theta)
        for name, several in after.items():
            total = np.zeros(len(self.times(name)))
            for old, new in zip(before[name], several, strict=True):
                if new.signal == 'current' and name != 'drive':
                    change = new.factor * later - old.factor * now
                elif new.signal == 'drive_current':
                    change = new.factor * drive
                else:
                    continue
                total = total + self.test(name).project(change, new.order)
            answer[name] = total / step
        return answer

    def _current_change(self, moved: np.ndarray, current: np.ndarray) -> np.ndarray:
        """Change of the current of a command that is the one the motion asks for, A."""
        values = [{path.partition('.')[2]: theta[slot.start] for path, slot in self.slots.items()
                   if path.startswith('drive.')} for theta in (self.servo.theta, moved)]
        speed = self.full(self.motion['motor_speed'])
        old, new = values
        if 'resistance' not in old:
            return (new.get('gain', 1.0) / (old.get('gain', 1.0) or 1.0) - 1.0) * current
        loop_old, loop_new = (v['resistance'] + v.get('proportional', 0.0) for v in values)
        volts = (loop_old * current + old['back_emf'] * speed) / old['gain']
        return (new['gain'] * volts - new['back_emf'] * speed) / loop_new - current

    @cached_property
    def nominal(self) -> dict[str, np.ndarray]:
        """The residuals of the servo file."""
        return self.residuals(self.servo.theta)

    def residuals(self, theta: np.ndarray, only: Collection[str] | None = None,
                  settings: Mapping[int, float] | None = None) -> dict[str, np.ndarray]:
        """
        Return the residual of each equation at its centres; NaN where nothing can be said.

        ``theta`` are values of the servo, ``only`` limits the equations, ``settings`` are changes
        of the controller's values (by slot) in this recording.
        """
        terms = {name: rows for name, rows in self._terms(theta).items()
                 if only is None or name in only}
        readings = self._readings
        if self._sensing.any():
            readings = self._corrected(theta)
        same = readings is self._readings or all(
            np.array_equal(a, b, equal_nan=True)
            for a, b in zip(readings.values(), self._readings.values(), strict=True))
        motions = (self.motion, self.gear_motion) if same else self._motions(readings)
        answer: dict[str, np.ndarray] = {}
        models: dict[int, np.ndarray] = {}
        for name, several in terms.items():
            total = np.zeros(())
            for term in several:
                series = self._series(term.signal, name, theta, readings, motions, models,
                                      settings)
                if series is not None:
                    total = total + term.factor * self._project(series, term, name, same)
            answer[name] = total
        return answer

    def of_signal(self, signal: str, series: np.ndarray,
                  theta: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """
        Return what a signal (a column of the terms) adds to each residual at its centres.

        ``series`` has shape (samples,) or (samples, n); it is known at every sample, or at the
        inner ones of the motion of the shafts.
        """
        theta = self.servo.theta if theta is None else theta
        answer: dict[str, np.ndarray] = {}
        for name, several in self._terms(theta).items():
            for term in several:
                if term.signal != signal:
                    continue
                test = self.test(name)
                part = term.factor * test.project(self.full(series), term.order)
                answer[name] = answer[name] + part if name in answer else part
        return answer

    def _terms(self, theta: np.ndarray) -> dict[str, tuple[Term, ...]]:
        values = {path: theta[slot.start] for path, slot in self.slots.items()}
        return equation_terms(values, self.measured.channels, self.measured.looped)

    def _series(self, signal: str, equation: str, theta: np.ndarray,
                readings: Mapping[str, np.ndarray], motions: tuple[Motion, Motion],
                models: dict[int, np.ndarray], settings: Mapping[int, float] | None
                ) -> np.ndarray | None:
        """Return a signal at every sample, NaN where it is not known; None: it is zero."""
        if signal in ('motor_position', 'load_position'):
            return self._angles(readings)[signal == 'load_position']
        if signal == 'current' and 'current' not in self.measured.channels:
            return self.drive_current(theta)
        if signal == 'drive_current':
            return self.drive_current(theta)
        if signal == 'controller_output':
            return self.controller_output(theta, settings)
        if signal == 'external_torque':
            return self.measured.column(signal, 0.0)
        if signal in readings:
            return readings[signal]
        motion = motions[equation == 'transmission']
        if id(motion) not in models:
            models[id(motion)] = self.evaluated(theta, motion)
        out = dict(zip(EVALUATED, models[id(motion)].T, strict=True))
        if signal == 'motor_torque':
            return self.full(out['motor_push'] + out['motor_resistance'], motion)
        if signal == 'load_torque':
            return self.full(out['load_push'] + out['load_resistance'], motion)
        return self.full(self._torsion(theta, out, motion), motion)

    def _torsion(self, theta: np.ndarray, out: Mapping[str, np.ndarray], motion: Motion
                 ) -> np.ndarray:
        """Torsion beside the linear one, rad: kinematic error, half the gap, bent elasticity."""
        torsion = out['lost'] + self.flank(motion) * out['half_gap']
        slot = self.slots.get('mechanism.stiffness')
        if slot is not None and out['spring'].any():
            torsion = torsion - out['spring'] / theta[slot.start]
        return torsion

    def _project(self, series: np.ndarray, term: Term, equation: str, keep: bool) -> np.ndarray:
        test = self.test(equation)
        key = (term.signal, term.order, test)
        fixed = term.signal in ('motor_position', 'load_position', 'torque', 'external_torque',
                                'voltage') or (
            term.signal == 'current' and 'current' in self.measured.channels)
        if not (keep and fixed):
            return test.project(series, term.order)
        if key not in self._projected:
            self._projected[key] = test.project(series, term.order)
        return self._projected[key]
