"""
A residual network beside a model, the black-box end of the scale (paper 001 eq. 22 to 27).

What the model lacks is taken from the torque balance of the whole machine along the measured
motion, at the load,

.. math:: \\tau = (N J_m \\alpha_m + J_l \\alpha_l) + T_{ext} - N (K_m i + \\tau_m) - \\tau_l

with all laws of the model in :math:`\\tau_m` and :math:`\\tau_l` and the current that the model's
own drive makes of the command. Two inputs, that current and the speed; ten sigmoids; one output.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from servo_twin.physics.catalogue import find
from servo_twin.physics.driven_current import driven_current
from servo_twin.physics.kernel import fresh_state, kernel_of
from servo_twin.physics.motion_evaluation import EVALUATED, MOTION
from servo_twin.physics.servo import Placed, Provenance, Servo
from servo_twin.recording.recording import Recording

from ...fit.estimate import bag_name
from ...fit.segments import smoothed
from ..error_scores import Scores, scores_of
from ..friction.friction_network import Network, trained

HIDDEN = 10  # nodes, paper 001 eq. 22
CUTOFF = 20.0  # Hz, zero phase, of the motion
SLOW = 0.02  # of the top speed: below it a shaft may stick, and its friction is any
EVERY = 0.005  # s between the rows that are trained on
FIFTH = 5  # one second of so many is kept back


@dataclass(frozen=True)
class LearnedResidual:
    """The network, of tansig nodes as trained; ``scores`` in N m on the seconds kept back."""

    network: Network
    scores: Scores
    bags: tuple[str, ...]


def learned_residual(servo: Servo, recordings: Sequence[Recording], *, seed: int = 0,
                     told: Callable[[int, float, float], None] | None = None) -> LearnedResidual:
    """
    Learn what the servo lacks of torque at the load, over current and speed.

    Raises ValueError for recordings without a command or without a position.
    """
    if not recordings:
        raise ValueError('there is no recording to learn a residual from')
    bare = without_residual(servo)
    parts = [_missing(bare, recording) for recording in recordings]
    current, speed, missing, second = (np.concatenate(column) for column in zip(
        *parts, strict=True))
    held = second % FIFTH == 2
    network = trained(current, speed, missing, hidden=HIDDEN, held=held, seed=seed, told=told)
    return LearnedResidual(network, scores_of(missing[held], network(current[held], speed[held])),
                           tuple(bag_name(r) for r in recordings))


def without_residual(servo: Servo) -> Servo:
    """Return the servo without any residual network."""
    return servo.without_effects(lambda placed: placed.effect.name == 'network_residual')


def with_residual(servo: Servo, learned: LearnedResidual, name: str = 'residual') -> Servo:
    """Return the servo with the network in place of any it had."""
    placed = Placed(name, find('network_residual'), 'load')
    values = placed.paths(learned.network.sigmoid_values('current', 'speed'))
    said = Provenance('torque that was missing, paper 001 eq. 27', None, learned.bags)
    return without_residual(servo).with_effects(
        placed, values=values, provenance=dict.fromkeys(values, said))


def _missing(servo: Servo, recording: Recording) -> tuple[np.ndarray, ...]:
    """Return current, speed, missing torque and running second of the rows that move."""
    period, value = recording.period, servo.values
    ratio = value['mechanism.ratio']
    if not recording.has('voltage'):
        raise ValueError(f'{recording.name}: voltage is missing: a residual network is given the '
                         'command')
    motor, load = (smoothed(recording[c], period, CUTOFF)
                   for c in ('motor_position', 'load_position'))
    motor = motor if recording.has('motor_position') else load * ratio
    load = load if recording.has('load_position') else motor / ratio
    if not np.isfinite(load).any():
        raise ValueError(f'{recording.name}: neither motor_position nor load_position is in it')
    motor_speed, load_speed = np.gradient(motor, period), np.gradient(load, period)
    motor_rate, load_rate = np.gradient(motor_speed, period), np.gradient(load_speed, period)
    kernel, theta, on = kernel_of(servo), servo.theta, servo.switches
    made = driven_current(servo, theta, np.nan_to_num(recording['voltage']),
                          np.nan_to_num(motor_speed), period)
    current = smoothed(made[:, 0], period, CUTOFF)
    torque = smoothed(recording['torque'], period, CUTOFF)
    external = smoothed(np.nan_to_num(recording['external_torque']), period, CUTOFF)
    warm = np.where(np.isfinite(recording['temperature']), recording['temperature'], 20.0)
    columns = dict(zip(MOTION, (
        motor, motor_speed, load, load_speed, load_rate, torque, motor / ratio - load,
        motor_speed / ratio - load_speed, current, external, warm,
        np.nan_to_num(recording['coupled_position'])), strict=True))
    motion = np.ascontiguousarray(np.column_stack([columns[name] for name in MOTION]))
    out = np.empty((len(motion), len(EVALUATED)))
    kernel.evaluate_models(theta, on, fresh_state(kernel), motion, out, period)
    made = dict(zip(EVALUATED, out.T, strict=True))
    missing = (ratio * value['mechanism.rotor_inertia'] * motor_rate
               + value['mechanism.load_inertia'] * load_rate + external
               - ratio * (value['drive.torque_constant'] * current + made['motor_push']
                          + made['motor_resistance']) - made['load_push']
               - made['load_resistance'])
    rows = np.arange(len(motion))[10:-10:max(1, round(EVERY / period))]
    rows = rows[np.abs(load_speed[rows]) > SLOW * np.nanmax(np.abs(load_speed))]
    rows = rows[np.isfinite(missing[rows])]
    return current[rows], load_speed[rows], missing[rows], (rows * period).astype(int)
