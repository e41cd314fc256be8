"""
The screw of paper 001 brought as a model of another tool: an FMU beside the built-in mechanism.

The drive, control and friction of the feed drive stay; its screw is two inertias on a spring, once
the built-in `two_inertia`, once the example FMU that is compiled from C. Both follow the same
wanted places in the position loop.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import sqrt
from pathlib import Path

import numpy as np

from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.fmu.example_fmu import made
from servo_twin.fmu.fmu_variables import mechanism_of
from servo_twin.physics.mechanisms.fmu import INSIDE
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state
from servo_twin.physics.state import ZERO

from .feed_drive.feed_results import AXES, PERIOD, sine
from .paper_systems import SYSTEMS
from .step_time import driven, stepped

VERSIONS = (2, 3)  # of FMI
RATE = 6000  # mm/min, the largest speed of the sine of place
DAMPED = 0.05  # of critical, between motor and table
PUSHED = 1000.0  # N, under which the screw's stiffness is taken
MAPPED = {
    'inputs': {'motor_torque': 'tau_m', 'external_torque': 'tau_ext'},
    'outputs': {'motor_angle': 'phi_m', 'motor_speed': 'w_m', 'load_angle': 'phi_l',
                'load_speed': 'w_l', 'torque': 'tau'},
    'start': {'motor_angle': 'phi_m0', 'motor_speed': 'w_m0', 'load_angle': 'phi_l0',
              'load_speed': 'w_l0'},
    'parameters': {'rotor_inertia': 'J_m', 'load_inertia': 'J_l', 'ratio': 'ratio',
                   'stiffness': 'c', 'damping': 'd'}}
"""What of the example FMU is what, as in the section `mechanism` of a servo file."""


def make(work: Path, pictured: Path, told: Callable[[str, float], None]) -> dict:
    """Make the FMUs, run them and the built-in mechanism; return the figures."""
    told('compiling', 0.0)
    folder = work / 'fmu'
    folder.mkdir(exist_ok=True)
    built_in = two_inertias(servo_file.load(servo_at(AXES['x'])))
    servos = {version: brought(built_in, made(folder, version)) for version in VERSIONS}
    told('running', 0.5)
    return beside(built_in, servos, sine(RATE))


def two_inertias(servo: Servo) -> Servo:
    """
    Return the feed drive with its screw as two inertias, without the backlash of its nut.

    Effects within the mesh, as that play, are refused beside an FMU. All that turns with the motor
    is one of the inertias, the table, in kg and m, the other one; the spring is as stiff as the
    screw is at the middle of its travel.
    """
    inside = tuple(p for p in servo.effects if p.effect.port in INSIDE)
    gone = tuple(f'effects.{p.name}.' for p in inside)
    v = {path: value for path, value in servo.values.items() if not path.startswith(gone)}
    tight = replace(servo, effects=tuple(p for p in servo.effects if p not in inside), values=v,
                    tolerance={}, provenance={})
    wound = -initial_state(tight, 0.0, 0.0, PUSHED)[ZERO]  # m
    turning = sum(v[f'mechanism.{name}_inertia'] for name in ('rotor', 'coupling', 'screw'))
    table, ratio, stiffness = v['mechanism.load_inertia'], v['mechanism.ratio'], PUSHED / wound
    moving = 1.0 / (1.0 / table + 1.0 / (turning * ratio**2))  # kg
    values = {'rotor_inertia': turning, 'load_inertia': table, 'ratio': ratio,
              'stiffness': stiffness, 'damping': 2.0 * DAMPED * sqrt(stiffness * moving)}
    return with_mechanism(tight, TwoInertia, values)


def brought(servo: Servo, fmu: Path) -> Servo:
    """Return a servo of two inertias with the example FMU in their place, of the same values."""
    values = {name: servo.values[f'mechanism.{name}'] for name in MAPPED['parameters']}
    return with_mechanism(servo, mechanism_of({'file': fmu, **MAPPED}, fmu.parent), values)


def with_mechanism(servo: Servo, mechanism: type, values: Mapping[str, float]) -> Servo:
    """Return a servo with another mechanism of these values."""
    kept = {path: v for path, v in servo.values.items() if not path.startswith('mechanism.')}
    return replace(servo, mechanism=mechanism, values=kept | {
        f'mechanism.{name}': v for name, v in values.items()})


def beside(built_in: Servo, fmus: Mapping[int, Servo], wanted: np.ndarray) -> dict:
    """
    Return how far each FMU is from the built-in mechanism, and how long its steps take.

    ``wanted`` (samples,), m, is followed in the closed loop. Of each version: ``motor`` rad and
    ``table`` m apart at most, ``step`` ns; beside them ``step`` of the built-in mechanism and the
    ``travel`` of its table, m.
    """
    u = driven(reference_position=wanted)
    ours, step = stepped(built_in, u, PERIOD, 'closed_loop')
    found = {'step': step, 'travel': float(np.ptp(ours[:, 1])), 'versions': {}}
    for version, servo in fmus.items():
        theirs, taken = stepped(servo, u, PERIOD, 'closed_loop')
        motor, table = np.abs(theirs - ours).max(axis=0)[:2]
        found['versions'][str(version)] = {'motor': float(motor), 'table': float(table),
                                           'step': taken}
    return found


def comparison_rows(found: Mapping) -> list[dict[str, str]]:
    """Return the row of docs/comparison.md."""
    name, = (system.name for system in SYSTEMS if system.part == 'fmu')
    versions = found['versions']
    motor, table = (max(one[place] for one in versions.values()) for place in ('motor', 'table'))
    costs = ' and '.join(f'{one["step"] / found["step"]:.1f} (FMI {version})'
                         for version, one in versions.items())
    return [{'system': name, 'paper': '', 'command': '',
             'runs': f'FMU of the screw as two inertias, compiled from C, FMI '
                     f'{" and ".join(versions)}, beside the same built in; position loop at '
                     f'F{RATE}',
             'ours': f'at most {table:.1g} m of {found["travel"]:.2g} m apart at the table, '
                     f'{motor:.1g} rad at the motor; a step takes {costs} times the '
                     f'{found["step"]:.0f} ns of the built-in one'}]
