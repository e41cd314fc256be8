r"""
An elasticity that one shaft alone tells: the other one swings, and asks for the torque of that.

A rigid twin turns both shafts alike. On a spring the shaft without an encoder is ahead or behind
by the torsion :math:`e`, and its inertia :math:`J` asks for what the twin does not know of. A twin
with another spring swings otherwise: what is missing is the difference of the two.

.. math:: J_l\ddot e + D\dot e + K e = T \text{ behind the motor's encoder}, \quad
          D\dot e + K e = T \text{ before that of the load}, \quad J\ddot e \text{ is missing}

:math:`T` is the torque that the load of a rigid twin asks for along the measured motion. Source:
paper 002 eq. 1 and 2, with the measured shaft led.
"""

from __future__ import annotations

from collections.abc import Callable

from numba import njit
import numpy as np
from scipy.signal import cont2discrete, lfilter, lfilter_zi

from servo_twin.balances.equation_terms import rotor_inertia

from ..decisions import FORM
from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import Columns, Hypothesis, Mechanism
from .loose_shaft import along_load
from .shape_search import best_shape, best_shapes, SHAPES

Made = tuple[Columns, float, float, int]
"""Columns, stiffness (0: by the amplitude), damping over stiffness (s), and how many tried."""

OTHER = 6.0  # times as stiff, or as soft, as the file has it
SWINGS = 4  # within the longest recording: a slower load is not told from the motion
FASTEST = 0.25  # of the sampling rate: a faster one is not sampled
APART, DAMPINGS = 0.25, 4  # log of the stiffness from one tried to the next: a resonance is narrow
STEP = 0.1  # of a radian of a swing that is integrated at once
DAMPED = (0.01, 1.0)  # share of critical damping of a load that swings
RELAXES = (1.0 / 64.0, 16.0)  # sample periods between which damping over stiffness is sought


def unseen_shaft(builder: Builder, residual: np.ndarray) -> Hypothesis | None:
    """
    Return the elasticity by what one shaft feels of the other; None without an inertia there.

    ``residual`` (samples,) tells how stiff it is, and how long the torsion takes to relax. The
    amplitude is the compliance, as for two encoders.
    """
    servo = builder.samples.servo
    values = servo.numbers
    if not min(rotor_inertia(values), values['mechanism.load_inertia']) > 0.0:
        return None
    if servo.mechanism.compliant:
        made = _other_spring if servo.mechanism.correctable else None
    else:
        made = _behind_motor if builder.by_motor else _before_load
    if made is None:
        return None
    columns, stiffness, relaxation, tried = made(builder, residual)
    mechanism = Mechanism('stiffness_error', 'mesh', 'mesh', ('load',), 'odd', memory=True)
    most = (1.0 + FORM) / stiffness if stiffness else np.inf  # what swings so does no more
    return builder.hypothesis(mechanism, columns, [1], (stiffness,), room=(0.0, most),
                              tried=tried, detail={'relaxation': relaxation})


def _other_spring(builder: Builder, residual: np.ndarray) -> Made:
    """Return what the unseen shaft does on another spring than that of the file."""
    servo = builder.samples.servo
    load, known = (servo.numbers[f'mechanism.{name}'] for name in ('load_inertia', 'stiffness'))

    def columns(stiffness: float, damped: float) -> Columns:
        other = servo.with_effects(values={
            'mechanism.stiffness': stiffness,
            'mechanism.damping': 2.0 * damped * np.sqrt(stiffness * load)})
        return builder.turned(other, stiffness)

    return _best(builder, (known / OTHER, known * OTHER), columns, residual)


def _behind_motor(builder: Builder, residual: np.ndarray) -> Made:
    """Return what a load on a spring does to the motor, by the spring that does most."""
    load, period = builder.samples.servo.numbers['mechanism.load_inertia'], _period(builder)

    def columns(stiffness: float, damped: float) -> Columns:
        spring = load, stiffness, 2.0 * damped * np.sqrt(stiffness * load)
        return builder.place('load_torque', lambda one: _behind(one, spring)[:, None], stiffness)

    swings = [load * (2.0 * np.pi * rate) ** 2 for rate in (
        SWINGS / builder.scales.duration, FASTEST / period)]
    return _best(builder, (swings[0], swings[1]), columns, residual)


def _best(builder: Builder, bounds: tuple[float, float],
          columns: Callable[[float, float], Columns], residual: np.ndarray) -> Made:
    """Return what is made of the stiffness between ``bounds``, and damping, that do most."""
    load = builder.samples.servo.numbers['mechanism.load_inertia']
    shapes = int(np.ceil(np.log(bounds[1] / bounds[0]) / APART)) + 1, DAMPINGS
    stiffness, damped = best_shapes(
        (bounds, DAMPED), lambda *numbers: builder.apart(
            columns(*numbers).table[:, 0]) / numbers[0], builder.apart(residual), whole=True,
        shapes=shapes)
    relaxation = 2.0 * damped * np.sqrt(load / stiffness)
    return columns(stiffness, damped), stiffness, relaxation, shapes[0] * shapes[1]


def _before_load(builder: Builder, residual: np.ndarray) -> Made:
    """Return what the motor does of its own before the load's encoder, by its compliance."""
    values, period = builder.samples.servo.numbers, _period(builder)
    inertia = rotor_inertia(values) * values['mechanism.ratio']  # for the load's angle

    def columns(relaxation: float) -> Columns:
        return builder.place('motor_torque', lambda one: (
            -inertia * _ahead(one, relaxation)[:, None]))

    relaxation = best_shape(
        RELAXES[0] * period, RELAXES[1] * period,
        lambda number: builder.apart(columns(number).table[:, 0]), builder.apart(residual))
    return columns(relaxation), 0.0, relaxation, SHAPES


def _period(builder: Builder) -> float:
    return max(one.measured.period for one in builder.samples.errors)


def _behind(one: EquationErrors, spring: tuple[float, float, float]) -> np.ndarray:
    """
    Return what a load that swings does not ask the motor for, N m at the inner samples.

    ``spring`` is its inertia, and the stiffness and damping of the transmission.
    """
    period, (angle, speed, push, resists) = one.measured.period, along_load(one)
    rigid = spring[0] * np.gradient(speed, period) - push + np.sign(speed) * resists
    steps = max(1, int(np.ceil(np.sqrt(spring[1] / spring[0]) * period / STEP)))
    return rigid - _transmitted(angle, speed, push, resists, float(rigid[0]), spring, period,
                                steps)


@njit(cache=True, nogil=True)
def _transmitted(angle: np.ndarray, speed: np.ndarray, push: np.ndarray, resists: np.ndarray,
                 first: float, spring: tuple[float, float, float], period: float, steps: int
                 ) -> np.ndarray:
    """
    Return the torque on a load that swings, N m, at every sample; it begins with ``first``.

    All is seen from the load; ``push`` and ``resists`` N m act on it, angle and speed are the
    motor's.
    """
    inertia, stiffness, damping = spring
    torque, h = np.zeros(len(angle)), period / steps
    load, turns = angle[0] - first / stiffness, speed[0]
    torque[0] = first
    for k in range(1, len(angle)):
        grows = (speed[k] - speed[k - 1]) / period
        brake = h * resists[k] / inertia
        for n in range(1, steps + 1):
            left = period - n * h
            motor = speed[k] - left * grows
            twist = angle[k] - left * (speed[k] - 0.5 * left * grows) - load
            torque[k] = stiffness * twist + damping * (motor - turns)
            turns += h * (torque[k] + push[k]) / inertia
            turns = max(turns - brake, 0.0) if turns > 0.0 else min(turns + brake, 0.0)
            load += h * turns
    return torque


def _ahead(one: EquationErrors, relaxation: float) -> np.ndarray:
    """Return the acceleration of the torsion of a compliance of one, at every sample."""
    period, torque = one.measured.period, np.nan_to_num(one.full(asked(one)))
    above, below, _ = cont2discrete(([1.0], [relaxation, 1.0]), period, 'foh')
    above = above.ravel()
    torsion = lfilter(above, below, torque, zi=lfilter_zi(above, below) * torque[0])[0]
    return np.gradient(np.gradient(torsion, period), period)


def asked(one: EquationErrors) -> np.ndarray:
    """
    Return the torque that the load asks for, N m at the inner samples, without a torque sensor.

    The load's inertia takes most of it. Its acceleration is that of the reading, which the test
    function smooths once, as it does the equation: smoothed twice, a resonance would be too small.
    """
    torque, period = one.transmitted(), one.measured.period
    if 'torque' in one.measured.channels:
        return torque
    inertia = one.servo.numbers['mechanism.load_inertia']
    torque = torque - inertia * one.motion['load_acceleration']
    sharp = np.pad(np.diff(one.angles()[1], 2), 1, mode='edge') / period**2
    return np.nan_to_num(one.full(torque)) + inertia * sharp
