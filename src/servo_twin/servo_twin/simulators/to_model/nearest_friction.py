"""Dry and viscous friction that come nearest to laws that a simulator has not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...physics.kernel import fresh_state, kernel_of
from ...physics.motion_evaluation import EVALUATED, MOTION
from ...physics.servo import Servo
from ...physics.simulate import ROOM_TEMPERATURE
from ..joint import ModelError
from ..runs.joint_excitation import Excitation
from ..runs.twin_run import twin_run

_STANDING = 1e-3  # share of the largest speed below which a sample is left out
_CREEP = 1e-9  # rad/s
_FEWEST = 20  # samples in motion
_SHAFTS = ('friction', 'torque')  # ports whose laws push or resist a shaft


@dataclass(frozen=True)
class NearestFriction:
    """
    Friction at the joint beside that which goes over as it is.

    ``dry`` (N m) and ``viscous`` (N m s/rad) may be below zero; ``stiction`` (N m) is what
    resists at rest above all dry friction; ``left`` (N m) the rms of what neither explains.
    """

    dry: float
    viscous: float
    stiction: float
    left: float


def lossy(servo: Servo, lost: set[str]) -> list[str]:
    """Return those of the lost effects that push or resist a shaft."""
    return [placed.name for placed in servo.effects
            if placed.name in lost and placed.effect.port in _SHAFTS]


def nearest_friction(servo: Servo, names: list[str], excitation: Excitation) -> NearestFriction:
    r"""
    Fit what some effects resist with, over the motion that an excitation makes of the servo.

    .. math:: \min_{f, b} \sum_k \left(\tau_k - f\,\mathrm{sgn}(\dot q_k) - b\,\dot q_k\right)^2

    :math:`\tau` is the difference of the torques of all laws with and without these effects. By
    least squares over the samples at which the joint moves. Raises ModelError where it hardly
    does.
    """
    motion = _motion(servo, excitation)
    torque = _resisting(servo, names, motion, excitation.period)
    speed = motion[:, MOTION.index('load_speed')]
    moving = np.abs(speed) > _STANDING * np.abs(speed).max(initial=1e-12)
    if moving.sum() < _FEWEST or not np.abs(speed).max() > 0.0:
        raise ModelError(f'{servo.name}: over {excitation.said("rad")} it hardly moves, and what '
                         f'its friction is like cannot be seen; give a larger --amplitude or a '
                         f'longer --duration')
    rows = np.column_stack([np.sign(speed), speed])[moving]
    (dry, viscous), *_ = np.linalg.lstsq(rows, torque[moving], rcond=None)
    left = float(np.sqrt(np.mean((torque[moving] - rows @ [dry, viscous]) ** 2)))
    at_rest = friction_at_rest(servo, names)
    return NearestFriction(float(dry), float(viscous), max(0.0, at_rest - float(dry)), left)


def friction_at_rest(servo: Servo, names: list[str]) -> float:
    """Return what some effects resist with while the joint begins to move at zero, N m."""
    still = np.zeros((1, len(MOTION)))
    for name in ('motor_speed', 'load_speed'):
        still[:, MOTION.index(name)] = _CREEP
    still[:, MOTION.index('temperature')] = ROOM_TEMPERATURE
    return float(_resisting(servo, names, still, servo.step)[0])


def _motion(servo: Servo, excitation: Excitation) -> np.ndarray:
    """Return the motion as the kernel's `follow` takes it, without what sensors do wrong."""
    on = np.array([placed.effect.port != 'sensor' for placed in servo.effects], dtype=np.bool_)
    y = twin_run(servo, excitation, on if servo.effects else None)
    period, ratio = excitation.period, servo.values['mechanism.ratio']
    motor, load, torque, current = y[:, 0], y[:, 1], y[:, 2], y[:, 3]
    speed = np.gradient(load, period)
    wind_up = motor / ratio - load
    of = {'motor_angle': motor, 'motor_speed': np.gradient(motor, period), 'load_angle': load,
          'load_speed': speed, 'load_acceleration': np.gradient(speed, period), 'torque': torque,
          'wind_up': wind_up - wind_up[0], 'wind_up_rate': np.gradient(wind_up, period),
          'current': current, 'external': np.zeros(len(y)),
          'temperature': np.full(len(y), ROOM_TEMPERATURE), 'coupled_angle': np.zeros(len(y))}
    return np.ascontiguousarray(np.column_stack([of[name] for name in MOTION]))


def _resisting(servo: Servo, names: list[str], motion: np.ndarray, period: float) -> np.ndarray:
    """Return what some effects take from the joint along a motion, N m, signed as resistance."""
    lever = servo.values['mechanism.ratio'] * servo.values.get('mechanism.efficiency', 1.0)
    kernel, torques = kernel_of(servo), []
    for kept in (True, False):
        on = np.array([kept or placed.name not in names for placed in servo.effects],
                      dtype=np.bool_)
        out = np.zeros((len(motion), len(EVALUATED)))
        kernel.evaluate_models(servo.theta, on, fresh_state(kernel), motion, out, period)
        at = {name: out[:, k] for k, name in enumerate(EVALUATED)}
        torques.append(lever * (at['motor_push'] + at['motor_resistance'])
                       + at['load_push'] + at['load_resistance'])
    return torques[1] - torques[0]
