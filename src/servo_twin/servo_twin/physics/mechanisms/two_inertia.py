"""Motor and load joined by an elastic mesh."""

from ..effect import Parameter
from ..ideal_ports import (
    load_friction,
    load_torque,
    mesh_clearance,
    mesh_error,
    mesh_error_slope,
    mesh_torque,
    motor_friction,
    motor_torque,
)
from ..ports import Shaft, Teeth, WindUp
from ..servo_parts import Mechanism
from ..state import (
    ADDED,
    CURRENT,
    LOAD_ANGLE,
    LOAD_DIRECTION,
    LOAD_REVERSAL,
    LOAD_SPEED,
    MOTOR_ANGLE,
    MOTOR_DIRECTION,
    MOTOR_REVERSAL,
    MOTOR_SPEED,
    SWELL,
    TIME,
    TORQUE,
    ZERO,
)
from .friction_step import slide

# ruff: noqa: F821  (mechanism_pull is this mechanism's pull, compiled)


class TwoInertia(Mechanism):
    r"""
    Two inertias, a reducer and a spring.

    .. math:: J_m\ddot\theta_m = K_m i - T/N, \quad J_l\ddot\theta_l = T - T_{ext},
              \quad T = K_{eq}(\theta_m/N - \theta_l)

    Semi-implicit Euler; stable while the step is below 2 / (its highest natural frequency). An
    error that goes with the motor acts back on it, and its rate on the damper. Of an error over
    the load's turn the reaction on the load (1 + de/dtheta, within 1 %) and the rate are left out.
    """

    source = 'paper 000 eq. 1, 2'
    compliant = True
    carries = True

    rotor_inertia = Parameter(1.14e-4, 'kg m2', (1e-9, 1e3), 'Inertia on the motor shaft.',
                              required=True)
    load_inertia = Parameter(5.76, 'kg m2', (1e-9, 1e6), 'Inertia on the load shaft.',
                             required=True)
    ratio = Parameter(161.0, '', (1e-3, 1e5), 'Motor turns for one turn of the load.',
                      required=True)
    stiffness = Parameter(5e5, 'N m/rad', (1e-3, 1e10), 'Of the transmission, seen from the load.',
                          required=True)
    damping = Parameter(40.0, 'N m s/rad', (0.0, 1e7), 'Of the transmission, seen from the load.',
                        off=0.0, required=True)

    @classmethod
    def springs(cls, values, stiffer, denser):
        """Return inertias, springs and dampers of motor and load near rest."""
        turns = 1.0 / values['ratio']
        torsion = [[turns * turns, -turns], [-turns, 1.0]]
        stiffness = max(0.0, values['stiffness'] + stiffer)
        damping = max(0.0, values['damping'] + denser)
        return ([values['rotor_inertia'], values['load_inertia']],
                [[stiffness * share for share in row] for row in torsion],
                [[damping * share for share in row] for row in torsion])

    @staticmethod
    def rest(p, torque):
        """Torsion that carries ``torque`` (N m), rad."""
        return torque / p.stiffness

    @staticmethod
    def pull(p, wind_up, rate):
        """Torque on the load (N m) of the linear mesh at a torsion (rad) and its rate (rad/s)."""
        return p.stiffness * wind_up + p.damping * rate

    @staticmethod
    def step(p, theta, on, x, current_torque, external, temperature, h):
        turns = 1.0 / p.ratio  # quotients of constants are taken once, before the first step
        motor, load, time = x[MOTOR_ANGLE], x[LOAD_ANGLE], x[TIME]

        # the mesh: what error and clearance leave of the torsion carries torque
        driven = motor * turns
        teeth = Teeth(motor, load, x[LOAD_DIRECTION], abs(load - x[LOAD_REVERSAL]), x[TORQUE],
                      driven)
        wind_up = driven - load - x[ZERO] - mesh_error(theta, on, x, teeth, h)
        half = 0.5 * max(mesh_clearance(theta, on, x, teeth, h), 0.0)  # in this order NaN stays
        wind_up -= min(max(-half, wind_up), half)
        touching = half == 0.0 or wind_up != 0.0
        # an error that goes with the motor turns the far side of the damper as well
        turned = turns - mesh_error_slope(theta, on, x, teeth, h)
        rate = (x[MOTOR_SPEED] * turned - x[LOAD_SPEED]) if touching else 0.0
        torque = mechanism_pull(p, wind_up, rate)
        torque += mesh_torque(theta, on, x, WindUp(wind_up, rate, load), h)
        x[TORQUE] = torque

        # the motor shaft
        travel = abs(motor - x[MOTOR_REVERSAL])
        felt = torque * turned
        shaft = Shaft(motor, x[MOTOR_SPEED], x[MOTOR_DIRECTION], felt, travel, x[CURRENT],
                      temperature, time)
        push = current_torque - felt + motor_torque(theta, on, x, shaft, h)
        way = 1.0 if x[MOTOR_SPEED] + h / p.rotor_inertia * push > 0.0 else -1.0
        shaft = Shaft(motor, x[MOTOR_SPEED], way, felt, travel, x[CURRENT], temperature, time)
        budget = max(motor_friction(theta, on, x, shaft, h), 0.0)
        slide(x, MOTOR_ANGLE, MOTOR_DIRECTION, push, budget, p.rotor_inertia, h)

        # the load shaft
        travel = abs(load - x[LOAD_REVERSAL])
        shaft = Shaft(load, x[LOAD_SPEED], x[LOAD_DIRECTION], torque, travel, x[CURRENT],
                      temperature, time)
        inertia = p.load_inertia + x[ADDED]
        push = torque - external + load_torque(theta, on, x, shaft, h)
        push -= x[SWELL] / (1.0 + h * x[SWELL] / inertia) * x[LOAD_SPEED]  # see Mechanism
        way = 1.0 if x[LOAD_SPEED] + h / inertia * push > 0.0 else -1.0
        shaft = Shaft(load, x[LOAD_SPEED], way, torque, travel, x[CURRENT], temperature, time)
        budget = max(load_friction(theta, on, x, shaft, h), 0.0)
        slide(x, LOAD_ANGLE, LOAD_DIRECTION, push, budget, inertia, h)

        x[TIME] = time + h
