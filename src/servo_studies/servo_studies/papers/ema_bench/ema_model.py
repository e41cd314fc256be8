"""
The model under the operating conditions of a recording, and what is identified of it.

As paper 002: the command is a sinusoid whose frequency, phase, amplitude and offset come from the
record; the model gets that sinusoid and nothing else, and runs in closed loop. Where in its gap
the mesh begins cannot be known from one sample, so that one angle is taken from the record as
well: the zero of the torsion is set such that the median of the angle lost between the shafts
agrees.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import least_squares

from servo_identify.fit.estimate import bag_name
from servo_identify.fit.free_values import freedom_of
from servo_identify.learn.sinusoid import recovered, Sinusoid
from servo_twin.physics.servo import Provenance, Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS, ZERO
from servo_twin.recording.recording import Recording

from .ema_recordings import Case

FREE = (
    'mechanism.rotor_inertia', 'effects.brake.gain', 'effects.brake.cosine', 'effects.brake.sine',
    'effects.brake.grip', 'effects.brake.fade', 'effects.motor_coulomb.level',
    'effects.motor_viscous.slope', 'effects.encoder_coulomb.level', 'effects.runout.cosine[0]',
    'effects.runout.sine', 'effects.cogging.cosine', 'effects.cogging.sine')
BOUNDS = {'effects.brake.fade': (0.2, 20.0), 'effects.runout.cosine': (-5e-3, 5e-3),
          'effects.runout.sine': (-5e-3, 5e-3),
          'effects.cogging.cosine': (-0.2, 0.2), 'effects.cogging.sine': (-0.2, 0.2)}
CHANNELS = (0, 1, 3)  # motor position, load position, current, of a servo's outputs
COLUMNS = ('motor_position', 'load_position', 'current')
ROUNDS = 3  # of weights and beginnings, which follow the fit
THIN = 4  # one of so many samples is enough to fit by


class Conditions:
    """One recording made ready for the model: its command, recovered, and where it begins."""

    def __init__(self, case: Case, recording: Recording) -> None:
        self.case, self.recording = case, recording
        self.command: Sinusoid = recovered(recording['reference_position'], recording.period)
        columns = {name: np.full(len(recording), np.nan) for name in INPUTS}
        columns['reference_position'] = self.command(recording.time)
        self.inputs = inputs_of(columns)
        self.measured = np.column_stack([recording[name] for name in COLUMNS])
        self.shift = 0.0  # rad at the load, of the zero of the torsion

    def rolled(self, servo: Servo, theta: np.ndarray | None = None) -> np.ndarray:
        """Run the servo, set as the bench was, from the first sample; (samples, OUTPUTS)."""
        x = initial_state(servo, *self.measured[0, :2], theta=theta)
        x[ZERO] += self.shift
        return simulate(servo, self.inputs, self.recording.period, x, 'closed_loop', theta)

    def seat(self, servo: Servo, theta: np.ndarray | None = None) -> None:
        """Find where in its gap the mesh begins."""
        ratio = servo.values['mechanism.ratio']
        y = self.rolled(servo, theta)
        lost = (self.measured[:, 0] - y[:, 0]) / ratio - (self.measured[:, 1] - y[:, 1])
        self.shift += float(np.median(lost))


def identified(servo: Servo, cases: Sequence[Case], recordings: Sequence[Recording],
               told: Callable[[str, float], None] | None = None
               ) -> tuple[Servo, dict[str, float]]:
    """
    Return the servo whose closed-loop runs over the recordings fit best, and standard errors.

    Bounded least squares on both positions and the current, each in units of what the round
    before left of it. Errors are those of independent residuals, and so the least there can be.
    """
    freedom = freedom_of(servo, FREE, BOUNDS)
    conditions = [Conditions(*pair) for pair in zip(cases, recordings, strict=True)]
    variants = [case.of(servo) for case in cases]
    base = [variant.theta for variant in variants]
    x = np.clip(servo.theta[freedom.index], freedom.low, freedom.high) / freedom.scale
    weights = [1.0 / np.maximum(c.measured.std(axis=0), 1e-9) for c in conditions]

    def thetas(x: np.ndarray) -> list[np.ndarray]:
        found = []
        for theta in base:
            moved = theta.copy()
            moved[freedom.index] = np.clip(x * freedom.scale, freedom.low, freedom.high)
            found.append(moved)
        return found

    def errors(x: np.ndarray) -> list[np.ndarray]:
        return [c.rolled(v, theta)[:, CHANNELS] - c.measured for c, v, theta in zip(
            conditions, variants, thetas(x), strict=True)]

    def residual(x: np.ndarray) -> np.ndarray:
        return np.concatenate([
            (e[::THIN] * w).ravel() for e, w in zip(errors(x), weights, strict=True)])

    for turn in range(ROUNDS):
        for c, v, theta in zip(conditions, variants, thetas(x), strict=True):
            c.seat(v, theta)
        weights = [1.0 / np.sqrt(np.mean(e ** 2, axis=0)) for e in errors(x)]
        found = least_squares(residual, x, diff_step=1e-3, x_scale=1.0,
                              bounds=(freedom.low / freedom.scale, freedom.high / freedom.scale),
                              max_nfev=15, ftol=1e-5, xtol=1e-5)
        x = found.x
        if told:
            told(f'identifying, round {turn + 1}', (turn + 1) / ROUNDS)
    spread = np.linalg.pinv(found.jac.T @ found.jac) * np.mean(found.fun ** 2)
    std = np.sqrt(np.maximum(np.diag(spread), 0.0)) * freedom.scale
    values = dict(zip(freedom.names, x * freedom.scale, strict=True))
    return (_with(servo, values, std, recordings),
            dict(zip(freedom.names, std.tolist(), strict=True)))


def _with(servo: Servo, values: dict[str, float], std: np.ndarray,
          recordings: Sequence[Recording]) -> Servo:
    changes, said = {}, {}
    bags = tuple(bag_name(r) for r in recordings)
    for (name, value), error in zip(values.items(), std, strict=True):
        path, _, rest = name.partition('[')
        if rest:
            row = list(changes.get(path, servo.values[path]))
            row[int(rest[:-1])] = float(value)
            changes[path] = tuple(row)
            said[path] = Provenance('closed-loop runs', None, bags)
        else:
            changes[path] = float(value)
            said[path] = Provenance('closed-loop runs', float(error), bags)
    changed = servo.with_values(changes)
    object.__setattr__(changed, 'provenance', {**servo.provenance, **said})
    return changed
