"""What the models reach on the test recordings of the bench."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from servo_identify.learn.error_scores import goodness_of_fit
from servo_identify.learn.free_run import EDGE, free_runs, FreeRun, rolled, speed_of
from servo_twin.physics.controllers import PositionLoop
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

POSITION_GAIN = 20.0
"""1/s: the recorded command of the position loop regressed on the error of position."""

CELLS = 360  # of the turn
DETAIL_CUTOFF = 60.0  # Hz, of speeds in which ripple is looked at
REVERSAL = 0.6  # s about the turn-round of the ramp


@dataclass(frozen=True)
class Course:
    """One test recording with what each model makes of it: time, signal, predictions by name."""

    title: str
    time: np.ndarray
    measured: np.ndarray
    predicted: dict[str, np.ndarray]

    def fits(self) -> dict[str, float]:
        """Return R (eq. 13) of each model."""
        rows = self._known()
        return {n: goodness_of_fit(self.measured[rows], p[rows])
                for n, p in self.predicted.items()}

    def errors(self) -> dict[str, float]:
        """Return the root mean square error of each model, in the unit of the signal."""
        rows = self._known()
        return {n: float(np.sqrt(np.mean((self.measured[rows] - p[rows]) ** 2)))
                for n, p in self.predicted.items()}

    def _known(self) -> np.ndarray:
        return np.isfinite(np.column_stack([self.measured, *self.predicted.values()])).all(axis=1)


def open_loop(servos: Mapping[str, Servo], recordings: list[Recording]
              ) -> dict[str, list[FreeRun]]:
    """Return the free runs of each model over the sixteen recordings of table 4."""
    return {name: free_runs(servo, recordings) for name, servo in servos.items()}


def position_controlled(servo: Servo) -> Servo:
    """Return the servo with the bench's position loop around its speed loop."""
    gains = {name: servo.values[f'controller.{name}'] for name in ('kp', 'ki', 'limit')}
    values = {k: v for k, v in servo.values.items() if not k.startswith('controller.')}
    values |= {'controller.kp': POSITION_GAIN, 'controller.kv': gains['kp'],
               'controller.ki': gains['ki'], 'controller.kd': 1.0,
               'controller.limit': gains['limit']}
    return replace(servo, controller=PositionLoop, values=values, provenance={}, tolerance={})


def velocity_loop(servos: Mapping[str, Servo], recording: Recording) -> Course:
    """Return the speed of the load in the velocity loop, rad/s (figure 12)."""
    period = recording.period

    def speed(angle: np.ndarray) -> np.ndarray:
        return speed_of(angle, period, DETAIL_CUTOFF)[EDGE:-EDGE]

    time = (np.arange(len(recording)) * period)[EDGE:-EDGE]
    return Course('velocity loop', time, speed(recording['load_position']),
                  {n: speed(rolled(s, recording, 'closed_loop')[:, 1]) for n, s in servos.items()})


def torque_over_turn(servos: Mapping[str, Servo], recording: Recording, constant: float
                     ) -> dict[str, Course]:
    """
    Return the motor torque over the load's angle at constant speed, N m (figure 13).

    ``constant`` is the torque constant by which the current of the rig is read, N m/A.
    """
    way = recording['reference_velocity']
    top = np.max(np.abs(way))
    answers = {name: rolled(servo, recording, 'closed_loop') for name, servo in servos.items()}
    courses = {}
    for title, going in (('forward', way > 0.99 * top), ('reverse', way < -0.99 * top)):
        rows = np.flatnonzero(going)[500:-500]

        def over_angle(angle: np.ndarray, torque: np.ndarray, rows=rows) -> np.ndarray:
            cell = np.mod(angle[rows], 2.0 * np.pi) / (2.0 * np.pi) * CELLS
            cell = np.minimum(cell.astype(int), CELLS - 1)
            count = np.bincount(cell, minlength=CELLS)
            return np.bincount(cell, torque[rows], CELLS) / np.where(count, count, np.nan)

        courses[title] = Course(
            title, (np.arange(CELLS) + 0.5) * 360.0 / CELLS,
            over_angle(recording['load_position'], constant * recording['current']),
            {name: over_angle(y[:, 1], servos[name].values['drive.torque_constant'] * y[:, 3])
             for name, y in answers.items()})
    return courses


def reversals(servos: Mapping[str, Servo], recordings: list[Recording]) -> list[Course]:
    """
    Return the angle of the load about the turn-round of a ramp, rad (figure 14).

    Where in its gap a mesh begins a run nobody knows: every model is given the rig's mean angle
    over the first tenth of a second, in forward motion, and what follows is judged.
    """
    courses = []
    for recording in recordings:
        peak = int(np.argmax(recording['reference_position']))
        last = len(recording) - 1 - int(np.argmax(recording['reference_position'][::-1]))
        reach = round(REVERSAL / recording.period)
        rows = slice(max(0, peak - reach // 2), last + reach)
        start, first = recording['load_position'][0], round(0.1 / recording.period)
        measured = recording['load_position'][rows] - start
        predicted = {}
        for name, servo in servos.items():
            y = rolled(position_controlled(servo), recording, 'closed_loop')
            predicted[name] = y[rows, 1] - start
            predicted[name] += np.mean((measured - predicted[name])[:first])
        courses.append(Course(recording.name, np.arange(len(recording))[rows] * recording.period,
                              measured, predicted))
    return courses
