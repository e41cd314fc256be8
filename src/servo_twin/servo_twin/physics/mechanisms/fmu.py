"""A mechanism that comes as an FMU: somebody else's model between our motor and our load."""

from typing import ClassVar

from ..effect import Parameter
from ..fmu_calls import (
    exchange,
    INPUT,
    INPUT_FACTOR,
    numbers_of,
    output,
    SHAFTS,
    STATUS,
    table_at,
)
from ..ideal_ports import load_friction, load_torque, motor_friction, motor_torque
from ..ports import Shaft
from ..servo_parts import Mechanism
from ..state import (
    CURRENT,
    LOAD_ANGLE,
    LOAD_DIRECTION,
    LOAD_REVERSAL,
    LOAD_SPEED,
    MOTOR_ANGLE,
    MOTOR_DIRECTION,
    MOTOR_REVERSAL,
    MOTOR_SPEED,
    TIME,
    TORQUE,
    ZERO,
)

# ruff: noqa: F821  (MECHANISM is where this mechanism's memory begins)

TABLE, TURN, MOTOR_OFFSET, LOAD_OFFSET = 0, 1, 2, 3
"""The memory: the address of the FMU's table, 0 while it has not begun; how many runs it has had,
which tells a copy of the state; what is added to the FMU's angles, rad."""

INSIDE = ('mesh', 'mesh_error', 'clearance')


class Fmu(Mechanism):
    r"""
    A model of the mechanism as a co-simulation FMU, one call a step.

    .. math:: \tau_m = K_m i + \sum\tau_{motor} - f_m, \quad
              \tau_{ext} = T_{ext} - \sum\tau_{load} + f_l

    are its inputs, held over the step; angles, speeds and the transmitted torque its outputs. Its
    inside belongs to it. Friction f of our effects is what would stop the shaft within the step,
    at most the budget, so that it sticks as with the other mechanisms; for that the inertia of
    the shaft must be told. An FMU that tells the transmitted torque has two shafts, one that does
    not moves as one, with both inertias and both budgets. Until it begins, and while the
    measurements pull the state, the shafts go on at the speeds they have.
    """

    source = 'FMI 2.0.4 and 3.0.1, sec. 4.2 (co-simulation)'
    compliant = False
    correctable = False
    memory = 4
    has_external: ClassVar[bool] = True

    @classmethod
    def refuses(cls, effect, site, values):
        """Say why an effect cannot act there, or return ''."""
        if effect.port in INSIDE:
            return ('acts in the transmission, which is inside the FMU; there are the ports '
                    'drive, torque, friction and sensor')
        if site == 'load' and effect.port in ('torque', 'friction') and not cls.has_external:
            return 'acts on the load, and the FMU is mapped without an input external_torque'
        inertia = {'motor': 'rotor_inertia', 'load': 'load_inertia'}.get(site)
        if effect.port == 'friction' and not values[f'mechanism.{inertia}'] > 0.0:
            return (f'needs mechanism.{inertia} in the servo file: friction asks what would stop '
                    f'the shaft')
        return ''

    @staticmethod
    def rest(p, torque):
        """Torsion that carries ``torque`` (N m), rad; none where the stiffness is not told."""
        return torque / p.stiffness if p.stiffness > 0.0 else 0.0

    @staticmethod
    def pull(p, wind_up, rate):
        """Torque on the load (N m) of the stiffness that is told."""
        return p.stiffness * wind_up

    @staticmethod
    def step(p, theta, on, x, current_torque, external, temperature, h):
        motor, load, time = x[MOTOR_ANGLE], x[LOAD_ANGLE], x[TIME]
        if x[MECHANISM + TABLE] == 0.0:
            x[MOTOR_ANGLE] += h * x[MOTOR_SPEED]
            x[LOAD_ANGLE] += h * x[LOAD_SPEED]
            x[TIME] = time + h
            return
        table = table_at(int(x[MECHANISM + TABLE]))
        numbers = numbers_of(table)
        two, ratio = table[SHAFTS] == 2, p.ratio

        # everything that pushes
        torque = x[TORQUE]
        motor_travel, load_travel = abs(motor - x[MOTOR_REVERSAL]), abs(load - x[LOAD_REVERSAL])
        at_motor = Shaft(motor, x[MOTOR_SPEED], x[MOTOR_DIRECTION], torque / ratio, motor_travel,
                         x[CURRENT], temperature, time)
        at_load = Shaft(load, x[LOAD_SPEED], x[LOAD_DIRECTION], torque, load_travel, x[CURRENT],
                        temperature, time)
        on_motor = current_torque + motor_torque(theta, on, x, at_motor, h)
        on_load = load_torque(theta, on, x, at_load, h) - external

        # what would stop each shaft within the step
        if two:
            stop_motor = p.rotor_inertia * x[MOTOR_SPEED] / h + on_motor - torque / ratio
            stop_load = p.load_inertia * x[LOAD_SPEED] / h + on_load + torque
        else:
            inertia = p.rotor_inertia + p.load_inertia / ratio**2
            stop_motor = inertia * x[MOTOR_SPEED] / h + on_motor + on_load / ratio
            stop_load = stop_motor * ratio

        # everything that resists
        motor_way = 1.0 if stop_motor > 0.0 else -1.0
        load_way = 1.0 if stop_load > 0.0 else -1.0
        at_motor = Shaft(motor, x[MOTOR_SPEED], motor_way, torque / ratio, motor_travel,
                         x[CURRENT], temperature, time)
        at_load = Shaft(load, x[LOAD_SPEED], load_way, torque, load_travel, x[CURRENT],
                        temperature, time)
        motor_budget = max(motor_friction(theta, on, x, at_motor, h), 0.0)
        load_budget = max(load_friction(theta, on, x, at_load, h), 0.0)
        if two:
            motor_resists = min(max(stop_motor, -motor_budget), motor_budget)
            load_resists = min(max(stop_load, -load_budget), load_budget)
            motor_stuck = abs(stop_motor) < motor_budget
            load_stuck = abs(stop_load) < load_budget
        else:
            budget = motor_budget + load_budget / ratio
            resists = min(max(stop_motor, -budget), budget)
            share = resists / budget if budget > 0.0 else 0.0
            motor_resists, load_resists = share * motor_budget, share * load_budget
            motor_stuck = load_stuck = abs(stop_motor) < budget

        # the FMU's step
        numbers[INPUT] = (on_motor - motor_resists) / numbers[INPUT_FACTOR]
        numbers[INPUT + 1] = (load_resists - on_load) / numbers[INPUT_FACTOR + 1]
        well = table[STATUS] == 0 and exchange(table, numbers, h)  # one that failed is left be
        x[TIME] = time + h
        if not well:
            x[MOTOR_ANGLE] = x[LOAD_ANGLE] = float('nan')
            return

        # what it answers
        motor_now = output(table, numbers, 0) + x[MECHANISM + MOTOR_OFFSET]
        load_now = output(table, numbers, 2) + x[MECHANISM + LOAD_OFFSET]
        if motor_now != motor_now:
            motor_now = (load_now + x[ZERO]) * ratio
        if load_now != load_now:
            load_now = motor_now / ratio - x[ZERO]
        motor_speed, load_speed = output(table, numbers, 1), output(table, numbers, 3)
        if motor_speed != motor_speed:
            motor_speed = (motor_now - motor) / h
        if load_speed != load_speed:
            load_speed = (load_now - load) / h
        if two:
            x[TORQUE] = output(table, numbers, 4)
        else:
            gained = (load_speed - x[LOAD_SPEED]) / h
            x[TORQUE] = p.load_inertia * gained - on_load + load_resists
        x[MOTOR_ANGLE], x[MOTOR_SPEED] = motor_now, motor_speed
        x[LOAD_ANGLE], x[LOAD_SPEED] = load_now, load_speed
        if motor_speed * x[MOTOR_DIRECTION] < 0.0 and not motor_stuck:
            x[MOTOR_DIRECTION], x[MOTOR_REVERSAL] = -x[MOTOR_DIRECTION], motor
        if load_speed * x[LOAD_DIRECTION] < 0.0 and not load_stuck:
            x[LOAD_DIRECTION], x[LOAD_REVERSAL] = -x[LOAD_DIRECTION], load


STANDARD = {
    'ratio': Parameter(1.0, '', (1e-3, 1e5), 'Motor turns for one turn of the load.',
                       required=True),
    'rotor_inertia': Parameter(0.0, 'kg m2', (0.0, 1e3), 'Of the motor shaft; 0: not told.'),
    'load_inertia': Parameter(0.0, 'kg m2', (0.0, 1e6), 'Of the load shaft; 0: not told.'),
    'stiffness': Parameter(0.0, 'N m/rad', (0.0, 1e10), 'From the load; 0: not told.'),
}
"""Parameters that every FMU mechanism has: our effects and balances ask for them."""
