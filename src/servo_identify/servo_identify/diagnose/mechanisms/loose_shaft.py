r"""
A clearance that one shaft alone tells: while the gap is crossed, nothing hangs at it.

The load coasts from where the torque on it changes sign until the other flank meets it. There both
go on with one speed at once. What the inertia, the weight and the friction of the load do to the
motor is missing before, and comes as a blow then.

.. math:: J_l\ddot\theta_l = \tau_l \text{ in the gap}, \quad
          T = J_l\ddot\theta_m/N - \tau_l \text{ at a flank}, \quad
          \Delta\dot\theta_l = \frac{N^2 J_m}{N^2 J_m + J_l}
          \left(\dot\theta_m/N - \dot\theta_l\right) \text{ as it is met}

By the encoder of the load, the motor leaves a flank as soon as it would pull the load back. What
it is given in the gap turns the motor alone, and comes as a blow when the other flank is met.

.. math:: N^2 J_m\ddot e = N\left(K_i i - \tau_m\right) - N^2 J_m\ddot\theta_l
          \text{ in the gap}, \quad \dot e = 0 \text{ as a flank is met}

Source: Nordin, Gutman: Automatica 38(10), 2002, the physical model of a backlash, with a shaft
that is stiff against the time of a sample. Where the servo file has a stiffness, the twin with
the gap tells where the load is: pulled to the motor's angle, as the one of the equations is.
"""

from __future__ import annotations

from numba import njit
import numpy as np

from servo_twin.balances.equation_terms import rotor_inertia
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import Columns, Hypothesis, Mechanism
from .shape_search import best_shape

WIDTHS = (3e-4, 0.3)  # shares of the travel between which a clearance is sought
SHAPES = 48  # widths tried: the blow of another one comes at another time
GAP = 'loose_load'  # name of the gap in the twin that has it
CONTACT = 0.25  # swings of the load at a flank, for one spacing of the test function


def loose_shaft(builder: Builder, residual: np.ndarray) -> Hypothesis | None:
    """
    Return a clearance by what one shaft feels of the other; None without an inertia there.

    ``residual`` (samples,) tells how wide it is, beside what was found to act on the load. The
    load of a rigid twin meets its flanks on a spring as stiff as the test function can tell, until
    a fit knows better.
    """
    stroke, servo = builder.scales.stroke('load_angle'), builder.samples.servo
    unseen = servo.numbers['mechanism.load_inertia'] if builder.by_motor else rotor_inertia(
        servo.numbers)
    if not min(stroke, unseen) > 0.0 or builder.known('clearance'):
        return None

    def columns(width: float) -> Columns:
        if servo.mechanism.compliant:
            return builder.turned(servo.with_effects(
                Placed(GAP, find('backlash'), 'mesh'),
                values={f'effects.{GAP}.width': width}), 1.0 / width, beside=True)
        if builder.by_motor:
            return builder.place('load_torque', lambda one: _missing(one, width)[:, None] / width)
        return builder.place('motor_torque', lambda one: (
            _run_free(one, width)[:, None] / width / servo.numbers['mechanism.ratio']))

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
    mechanism = Mechanism('backlash', 'clearance', 'mesh', ('load',), 'odd', memory=True)
    return builder.hypothesis(
        mechanism, columns(width), [1], (width,), tried=SHAPES, detail=contact_of(builder))


def contact_of(builder: Builder) -> dict[str, float]:
    """Return the teeth on which a rigid load is met, as stiff as the test function can tell."""
    if builder.samples.servo.mechanism.compliant:
        return {}
    return {'contact': CONTACT / min(one.motion.test.spacing * one.measured.period
                                     for one in builder.samples.errors)}


def along_load(one: EquationErrors
               ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """
    Return angle and speed of a load that turns with the motor, and what pushes and resists it.

    At the inner samples, rad, rad/s and N m; nothing pushes where nothing is known.
    """
    motion, of_file = one.motion, one.of_file
    angle, speed, push, resists = (np.nan_to_num(series) for series in (
        motion['load_angle'], motion['load_speed'],
        of_file['load_push'] - motion['external'] + one.known_beside_gap,
        np.abs(of_file['load_resistance'])))
    return angle, speed, push, resists


def _missing(one: EquationErrors, width: float) -> np.ndarray:
    """Return the torque that the load would ask of the motor without a gap, less that with it."""
    values = one.servo.numbers
    inertias = values['mechanism.load_inertia'], (
        rotor_inertia(values) * values['mechanism.ratio']**2)
    return _lost(*along_load(one), inertias, width, one.measured.period)


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


def _run_free(one: EquationErrors, width: float) -> np.ndarray:
    """Return the torque that turns the motor alone, N m at the load, with the sign reversed."""
    motion, of_file, values = one.motion, one.of_file, one.servo.numbers
    ratio = values['mechanism.ratio']
    rotor = rotor_inertia(values) * ratio**2
    current = motion['current'] if 'current' in one.measured.channels else one.inner(
        one.drive_current(one.servo.theta))
    driven = ratio * (values['drive.torque_constant'] * current
                      + of_file['motor_push'] + of_file['motor_resistance'])
    return -_free(np.nan_to_num(driven - rotor * motion['load_acceleration']), rotor, width,
                  one.measured.period)


@njit(cache=True, nogil=True)
def _free(torque: np.ndarray, rotor: float, width: float, period: float) -> np.ndarray:
    """Return what of a torque on the motor turns it in a gap; a blow where a flank is met."""
    free = np.zeros(len(torque))
    side, ahead, turns = 1.0, 0.5 * width, 0.0
    for k in range(len(torque)):
        if torque[k] * side > 0.0:
            continue
        turns += period * torque[k] / rotor
        ahead += period * turns
        side, free[k] = 0.0, torque[k]
        if abs(ahead) >= 0.5 * width:
            side = 1.0 if ahead > 0.0 else -1.0
            free[k] -= rotor * turns / period
            ahead, turns = 0.5 * width * side, 0.0
    return free
