"""
Open-loop free runs and their goodness of fit (paper 000 eq. 13).

The twin begins at rest where the rig begins, is given the command and nothing else, and is never
corrected. The paper records the angular velocity and speaks of the angular response; both are
judged here: the speed of the load, :math:`R_\\omega`, and its angle from the start,
:math:`R_\\theta`, in which every error of speed adds up.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count

import numpy as np
from scipy.optimize import least_squares

from servo_twin.lockstep.live_changes import changed
from servo_twin.physics.kernel import kernel_of
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import Recording

from ..fit.free_values import freedom_of
from ..fit.segments import smoothed
from .error_scores import goodness_of_fit

CUTOFF = 30.0  # Hz, zero phase, of speeds: an encoder's counts differ by more than they tell
EDGE = 20  # samples at either end that the differences of a filtered angle do not know
NOISES = 5.0  # deviations of the torque sensor that may still be none
THIN = 5  # one of so many samples is enough to fit by


@dataclass(frozen=True)
class FreeRun:
    """
    One recording and what a servo makes of its command.

    ``y`` (samples, OUTPUTS) of the twin; ``angle`` of the load as measured, rad; ``measured`` and
    ``predicted`` speed of the load, rad/s.
    """

    recording: Recording
    y: np.ndarray
    angle: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray

    @property
    def speed_fit(self) -> float:
        """Goodness of fit of the speed."""
        inner = slice(EDGE, -EDGE)
        return goodness_of_fit(self.measured[inner], self.predicted[inner])

    @property
    def angle_fit(self) -> float:
        """Goodness of fit of the angle from where the run began."""
        start = self.angle[0]
        return goodness_of_fit(self.angle - start, self.y[:, 1] - start)


def speed_of(angle: np.ndarray, period: float, cutoff: float = CUTOFF) -> np.ndarray:
    """Return the speed of an angle, filtered without a lag."""
    return np.gradient(smoothed(angle, period, cutoff), period)


def rolled(servo: Servo, recording: Recording, mode: str = 'measured_input',
           theta: np.ndarray | None = None) -> np.ndarray:
    """
    Run a servo from the first sample of a recording on, (samples, OUTPUTS).

    A torque within the noise of its sensor is none: the teeth begin in the middle of their gap.
    """
    motor, load, torque = (recording[c][0] for c in ('motor_position', 'load_position', 'torque'))
    if not abs(torque) > NOISES * servo.noise('torque'):
        torque = 0.0
    x = initial_state(servo, motor, load, torque, theta=theta)
    return simulate(servo, inputs_of(recording.columns), recording.period, x, mode, theta)


def free_run(servo: Servo, recording: Recording, theta: np.ndarray | None = None) -> FreeRun:
    """
    Return the free run of a servo under the command of a recording.

    Where no encoder sits on the load, its angle is that of the motor behind the ratio.
    """
    y = rolled(servo, recording, theta=theta)
    period, angle = recording.period, recording['load_position']
    if not recording.has('load_position'):
        angle = recording['motor_position'] / servo.values['mechanism.ratio']
    return FreeRun(recording, y, angle, speed_of(angle, period), speed_of(y[:, 1], period))


def free_runs(servo: Servo, recordings: Sequence[Recording],
              theta: np.ndarray | None = None) -> list[FreeRun]:
    """Return the free runs over several recordings, on all cores."""
    kernel_of(servo)
    with ThreadPoolExecutor(cpu_count()) as pool:
        return list(pool.map(lambda one: free_run(servo, one, theta), recordings))


def refined(servo: Servo, recordings: Sequence[Recording], free: Sequence[str],
            bounds: dict[str, tuple[float, float]] | None = None, evaluations: int = 40,
            told: Callable[[float], None] | None = None) -> tuple[Servo, float]:
    """
    Return the servo whose free runs over the recordings fit best, and their mean R of the speed.

    Bounded least squares on the errors of speed, each run in units of its own speed, which is
    what eq. 13 judges. ``free`` and ``bounds`` as of :func:`fitting.fit`, within the declared
    bounds; a value that leaves its tolerance has none any more. ``told`` is given the mean R at
    each evaluation.
    """
    freedom = freedom_of(servo, free, bounds, tolerance=False)
    begun = servo.theta
    start = np.clip(begun[freedom.index], freedom.low, freedom.high)

    def theta(x: np.ndarray) -> np.ndarray:
        moved = begun.copy()
        moved[freedom.index] = np.clip(x * freedom.scale, freedom.low, freedom.high)
        return moved

    def residual(x: np.ndarray) -> np.ndarray:
        runs = free_runs(servo, recordings, theta(x))
        parts = [(r.predicted - r.measured)[EDGE:-EDGE:THIN] / np.sqrt(
            np.sum(r.measured[EDGE:-EDGE:THIN] ** 2)) for r in runs]
        parts = [np.where(np.isfinite(p), p, 1.0) for p in parts]
        if told:
            told(1.0 - float(np.mean([np.linalg.norm(p) for p in parts])))
        return np.concatenate(parts)

    found = least_squares(residual, start / freedom.scale, diff_step=3e-3, x_scale=1.0,
                          bounds=(freedom.low / freedom.scale, freedom.high / freedom.scale),
                          max_nfev=evaluations, ftol=1e-4, xtol=1e-4)
    best = theta(found.x)
    values = {name: float(best[index])
              for name, index in zip(freedom.names, freedom.index, strict=True)}
    tuned = changed(servo, values, 'free runs over the training recordings, eq. 13')
    return tuned, float(np.mean([r.speed_fit for r in free_runs(tuned, recordings)]))
