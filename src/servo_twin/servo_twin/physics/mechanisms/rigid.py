"""Motor and load that move as one."""

from ..effect import Parameter
from ..ideal_ports import load_friction, load_torque, mesh_error, motor_friction, motor_torque
from ..ports import Shaft, Teeth
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


class Rigid(Mechanism):
    r"""
    One degree of freedom: the torsion is always zero.

    .. math:: (J_m + J_l/N^2)\,\ddot\theta_m = K_m i - T_{ext}/N, \quad
              \theta_l = \theta_m/N - e

    Holds well below the first natural frequency of the transmission. The transmitted torque is
    what the load side takes; while both sides stick, friction is shared in the ratio of the
    budgets.
    """

    source = 'paper 000 eq. 1 with infinite stiffness'
    compliant = False
    carries = True

    rotor_inertia = Parameter(1.14e-4, 'kg m2', (0.0, 1e3), 'Inertia on the motor shaft.',
                              required=True)
    load_inertia = Parameter(5.76, 'kg m2', (0.0, 1e6), 'Inertia on the load shaft.',
                             required=True)
    ratio = Parameter(1.0, '', (1e-3, 1e5), 'Motor turns for one turn of the load.', required=True)

    @classmethod
    def springs(cls, values, stiffer, denser):
        """Return the inertia of the one shaft, as the motor feels it; it has no spring."""
        inertia = values['rotor_inertia'] + values['load_inertia'] / values['ratio'] ** 2
        return [inertia], [[0.0]], [[0.0]]

    @staticmethod
    def rest(p, torque):
        """Torsion that carries ``torque`` (N m), rad: none."""
        return 0.0

    @staticmethod
    def pull(p, wind_up, rate):
        """Torque of the mesh (N m): not given by the torsion, which is always zero."""
        return 0.0

    @staticmethod
    def step(p, theta, on, x, current_torque, external, temperature, h):
        turns = 1.0 / p.ratio  # quotients of constants are taken once, before the first step
        motor, load, time = x[MOTOR_ANGLE], x[LOAD_ANGLE], x[TIME]
        carried = p.load_inertia + x[ADDED]
        inertia = p.rotor_inertia + carried * turns**2
        travel = abs(motor - x[MOTOR_REVERSAL])
        felt = x[TORQUE] * turns

        # everything that pushes, seen from the motor shaft
        at_motor = Shaft(motor, x[MOTOR_SPEED], x[MOTOR_DIRECTION], felt, travel, x[CURRENT],
                         temperature, time)
        at_load = Shaft(load, x[LOAD_SPEED], x[MOTOR_DIRECTION], x[TORQUE], travel * turns,
                        x[CURRENT], temperature, time)
        on_motor = current_torque + motor_torque(theta, on, x, at_motor, h)
        on_load = load_torque(theta, on, x, at_load, h) - external
        swell = x[SWELL] / (1.0 + h * x[SWELL] * turns**2 / inertia)  # see Mechanism
        on_load -= swell * x[LOAD_SPEED]
        push = on_motor + on_load * turns
        way = 1.0 if x[MOTOR_SPEED] + h / inertia * push > 0.0 else -1.0

        # everything that resists
        at_motor = Shaft(motor, x[MOTOR_SPEED], way, felt, travel, x[CURRENT], temperature, time)
        at_load = Shaft(load, x[LOAD_SPEED], way, x[TORQUE], travel * turns, x[CURRENT],
                        temperature, time)
        motor_budget = max(motor_friction(theta, on, x, at_motor, h), 0.0)
        load_budget = max(load_friction(theta, on, x, at_load, h), 0.0) * turns
        before = x[MOTOR_SPEED]
        budget = motor_budget + load_budget
        resisted = slide(x, MOTOR_ANGLE, MOTOR_DIRECTION, push, budget, inertia, h)

        # the load follows; what the mesh carries is what the load side took
        share = load_budget / budget if budget > 0.0 else 0.0
        speed_up = (x[MOTOR_SPEED] - before) * (turns / h)
        x[TORQUE] = carried * speed_up - on_load - share * resisted * p.ratio
        driven = x[MOTOR_ANGLE] * turns
        teeth = Teeth(x[MOTOR_ANGLE], load, x[MOTOR_DIRECTION], travel * turns, x[TORQUE], driven)
        x[LOAD_ANGLE] = driven - x[ZERO] - mesh_error(theta, on, x, teeth, h)
        x[LOAD_SPEED] = x[MOTOR_SPEED] * turns
        x[LOAD_DIRECTION] = x[MOTOR_DIRECTION]
        x[LOAD_REVERSAL] = x[MOTOR_REVERSAL] * turns

        x[TIME] = time + h
