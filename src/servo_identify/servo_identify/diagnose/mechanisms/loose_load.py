r"""
A clearance that the motor alone tells: while it crosses the gap, no load hangs at it.

The load coasts from where the torque on it changes sign until the other flank meets it. There both
go on with one speed at once. What the inertia, the weight and the friction of the load do to the
motor is missing before, and comes as a blow then.

.. math:: J_l\ddot\theta_l = \tau_l \text{ in the gap}, \quad
          T = J_l\ddot\theta_m/N - \tau_l \text{ at a flank}, \quad
          \Delta\dot\theta_l = \frac{N^2 J_m}{N^2 J_m + J_l}
          \left(\dot\theta_m/N - \dot\theta_l\right) \text{ as it is met}

Source: Nordin, Gutman: Automatica 38(10), 2002, the physical model of a backlash, with a shaft
that is stiff against the time of a sample. Where the servo file has a stiffness, the twin with
the gap tells where the load is: pulled to the motor's angle, as the one of the equations is.
"""

from __future__ import annotations

from numba import njit
import numpy as np

from servo_twin.balances.equation_terms import ROTATING
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

from ..residuals.equation_errors import EquationErrors
from ..residuals.measured import pulled
from .builder import Builder
from .hypothesis import Columns, Hypothesis, Mechanism
from .shape_search import best_shape

WIDTHS = (3e-4, 0.3)  # shares of the travel between which a clearance is sought
SHAPES = 48  # widths tried: the blow of another one comes at another time
GAP = 'loose_load'  # name of the gap in the twin that has it
CONTACT = 0.25  # swings of the load at a flank, for one spacing of the test function


def loose_load(builder: Builder, residual: np.ndarray) -> Hypothesis | None:
    """
    Return a clearance by what the motor alone feels of it; None where no load hangs at it.

    ``residual`` (samples,) tells how wide it is, beside what was found to act on the load. The
    load of a rigid twin meets its flanks on a spring as stiff as the test function can tell, until
    a fit knows better.
    """
    stroke, servo = builder.scales.stroke('load_angle'), builder.samples.servo
    if not stroke > 0.0 or not servo.numbers['mechanism.load_inertia'] > 0.0 or (
            builder.known('clearance')):
        return None

    def columns(width: float) -> Columns:
        return builder.place('load_torque', lambda one: _missing(one, width)[:, None] / width)

    beside = builder.apart(builder.place(
        'load_torque', lambda one: one.known_beside_gap[:, None]).table[:, 0])
    squares = float(beside @ beside) or 1.0

    def apart(column: np.ndarray) -> np.ndarray:
        told = builder.apart(column)
        return told - beside * (beside @ told / squares)

    widest = min(WIDTHS[1] * stroke, find('backlash').parameters['width'].bounds[1])
    width = best_shape(WIDTHS[0] / WIDTHS[1] * widest, widest,
                       lambda width: apart(columns(width).table[:, 0]), apart(residual),
                       shapes=SHAPES)
    spacing = min(one.motion.test.spacing * one.measured.period for one in builder.samples.errors)
    mechanism = Mechanism('backlash', 'clearance', 'mesh', ('load',), 'odd', memory=True)
    return builder.hypothesis(
        mechanism, columns(width), [1], (width,), tried=SHAPES,
        detail={} if servo.mechanism.compliant else {'contact': CONTACT / spacing})


def _missing(one: EquationErrors, width: float) -> np.ndarray:
    """Return the torque that the load would ask of the motor without a gap, less that with it."""
    motion, of_file, values = one.motion, one.of_file, one.servo.numbers
    angle, speed, push, resists = (np.nan_to_num(series) for series in (
        motion['load_angle'], motion['load_speed'],
        of_file['load_push'] - motion['external'] + one.known_beside_gap,
        np.abs(of_file['load_resistance'])))
    if one.servo.mechanism.compliant:
        return _behind_gap(one, width, push, resists)
    rotor = sum(values.get(f'mechanism.{part}_inertia', 0.0) for part in ROTATING)
    inertias = values['mechanism.load_inertia'], rotor * values['mechanism.ratio']**2
    return _lost(angle, speed, push, resists, inertias, width, one.measured.period)


def _behind_gap(one: EquationErrors, width: float, push: np.ndarray,
                resists: np.ndarray) -> np.ndarray:
    """
    Return the same of a load on a spring, by the twin with a gap and by the one of the equations.

    In the gap it asks for nothing. Before it has met a flank nobody knows where it hangs.
    """
    period, ratio = one.measured.period, one.servo.numbers['mechanism.ratio']
    gap = one.servo.with_effects(Placed(GAP, find('backlash'), 'mesh'), values={
        f'effects.{GAP}.width': width})
    recording, test = one.measured.recording, one.motion.test
    beside = np.zeros(len(recording))
    beside[test.reach:][:len(push)] = np.nan_to_num(one.known_beside_gap)
    motor, load, torque = (series[test.reach:][:len(push)] for series in pulled(
        recording, gap, 2 * test.spacing, beside))
    met = np.flatnonzero(torque)

    def asked(angle: np.ndarray) -> np.ndarray:
        speed = np.gradient(angle, period)
        return (one.servo.numbers['mechanism.load_inertia'] * np.gradient(speed, period)
                - push + np.sign(speed) * resists)

    loose = np.nan_to_num(one.motion['motor_angle']) / ratio - (motor / ratio - load)
    lost = np.zeros(len(push))
    if len(met):
        lost = asked(np.nan_to_num(one.motion['load_angle'])) - np.where(
            torque == 0.0, 0.0, asked(loose))
        lost[:met[0]] = 0.0
    return np.where(np.isfinite(lost), lost, 0.0)


@njit(cache=True, nogil=True)
def _lost(angle: np.ndarray, speed: np.ndarray, push: np.ndarray, resists: np.ndarray,
          inertias: tuple[float, float], width: float, period: float) -> np.ndarray:
    """All seen from the load; ``push`` and ``resists`` N m act on it, ``speed`` is the motor's."""
    inertia, rotor = inertias
    lost = np.zeros(len(angle))
    side, half = 1.0, 0.5 * width
    load, turns = angle[0] - half, speed[0]
    for k in range(1, len(angle)):
        friction = resists[k] if speed[k] > 0.0 else -resists[k]
        asked = inertia * (speed[k] - speed[k - 1]) / period - push[k] + friction
        if asked * side > 0.0 and (speed[k] - turns) * side >= 0.0:
            load, turns = angle[k] - side * half, speed[k]
            continue
        turns += period * push[k] / inertia
        brake = period * resists[k] / inertia
        turns = max(turns - brake, 0.0) if turns > 0.0 else min(turns + brake, 0.0)
        load += period * turns
        side, lost[k] = 0.0, asked
        if abs(angle[k] - load) >= half:
            side = 1.0 if angle[k] > load else -1.0
            load = angle[k] - side * half
            faster = max((speed[k] - turns) * side, 0.0) * side * rotor / (rotor + inertia)
            lost[k] -= inertia * faster / period
            turns += faster
    return lost
