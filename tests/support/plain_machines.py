"""Machines of few parts, and one call that runs them."""

from __future__ import annotations

import every_effect

from servo_twin.physics.catalogue import find
from servo_twin.physics.controllers import Open
from servo_twin.physics.drives import CurrentDrive
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.servo import Placed, Servo
from servo_twin.physics.simulate import initial_state, simulate
from servo_twin.physics.state import LOAD_SPEED, MOTOR_SPEED

UNIT_DRIVE = {'drive.gain': 1.0, 'drive.torque_constant': 1.0, 'mechanism.ratio': 1.0}
PERIOD = 1e-3


def two_inertia(motor=0.02, load=0.05, stiffness=200.0, damping=0.0, step=1e-4, **values):
    """Return the servo of every effect, switched off, as a plain two-inertia machine."""
    return every_effect.servo({
        **UNIT_DRIVE, 'mechanism.rotor_inertia': motor, 'mechanism.load_inertia': load,
        'mechanism.stiffness': stiffness, 'mechanism.damping': damping,
        **{f'effects.{k.replace("__", ".")}': v for k, v in values.items()}}, step)


def rigid(inertia=0.05, step=1e-4, **values):
    """Return one inertia on a spring with Coulomb, Stribeck and LuGre friction."""
    effects = tuple(Placed(name, find(f'{name}{kind}'), site) for name, kind, site in (
        ('coulomb', '_friction', 'load'), ('stribeck', '_friction', 'load'),
        ('presliding', '_friction', 'load'), ('spring', '_load', 'load')))
    off = {f'effects.{p.name}.{a}': 0.0 for p in effects for a in p.effect.amplitudes()}
    return Servo('rigid', CurrentDrive, Rigid, Open, (), effects, {
        **UNIT_DRIVE, **off, 'mechanism.rotor_inertia': 0.0, 'mechanism.load_inertia': inertia,
        **{f'effects.{k.replace("__", ".")}': v for k, v in values.items()}}, step=step)


def rolled(servo, u, on=None, motor=0.0, load=0.0, torque=0.0, motor_speed=0.0, load_speed=0.0):
    """Run a servo from a state and return what its sensors read and the state after it."""
    on = every_effect.only() if on is None else on
    x = initial_state(servo, motor, load, torque, on=on)
    x[MOTOR_SPEED], x[LOAD_SPEED] = motor_speed, load_speed
    return simulate(servo, u, PERIOD, x, on=on), x
