"""
The machines of the third rig: what they are and how they are asked to move.

A servo file says what the data sheets say; the machine itself is drawn within its tolerances. It
comes in three styles: `textbook` has inertias, gear, drive, loop, Coulomb and viscous friction;
`plain` has what the class is known for as well (a pendulum, a gap, cogging); `rich` has more.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .plant import CASCADE, Plant, POSITION_LOOP, SPEED_PI
from .rig_machine import Known, Machine

STYLES = ('textbook', 'plain', 'rich')


def _counts(turn: float) -> float:
    return 2.0 * np.pi / turn


_FRICTION = {'motor_coulomb': 0.2, 'motor_viscous': 0.3, 'load_coulomb': 0.15, 'load_viscous': 0.3}
_INERTIAS = {'rotor_inertia': 0.1, 'load_inertia': 0.08}
_GEAR = {**_INERTIAS, 'stiffness': 0.12, 'damping': 0.5}
_AMPLIFIER = {'gain': 0.02, 'torque_constant': 0.04}
_WINDING = {'resistance': 0.06, 'inductance': 0.2, 'torque_constant': 0.04}
_ALL = ('speed_ladder', 'slow_reversals', 'load_steps', 'multisine', 'moves', 'hold')


def _rigid(rotor: float, load: float, ratio: float, hertz: float) -> dict[str, float]:
    """Return inertias and a shaft that is too stiff to twist and too damped to ring."""
    both = rotor * ratio**2 * load / (rotor * ratio**2 + load)
    w = 2.0 * np.pi * hertz
    return {'ratio': ratio, 'rotor_inertia': rotor, 'load_inertia': load,
            'stiffness': both * w**2, 'damping': both * w}


JOINT = Machine(
    name='harmonic_joint', about='Joint of an industrial robot: strain-wave gear, torque sensor',
    plant=Plant(
        ratio=101.0, rotor_inertia=1.4e-4, load_inertia=1.9, stiffness=2.8e4, damping=18.0,
        torque_constant=0.118, gain=1.2, motor_coulomb=0.03, motor_viscous=2.2e-4,
        load_coulomb=1.8, load_viscous=1.6, controller=SPEED_PI, kv=11.0, ki=90.0, filter=1e-3,
        heat=0.06, motor_count=_counts(2**17), load_count=_counts(2**20), torque_count=0.02,
        current_count=1.5e-3),
    torque=60.0, speed=2.4, acceleration=12.0, travel=2.6, period=1e-3, step=4e-5, jitter=1e-6,
    tolerance={**_AMPLIFIER, **_GEAR, **_FRICTION}, families=(*_ALL, 'chirp'),
    noise={'motor_position': 3e-5, 'load_position': 2e-6, 'torque': 0.06, 'current': 8e-3,
           'temperature': 0.1},
    rich=(Known('breakaway', 'stribeck_friction', 'load',
                {'excess': 1.2, 'fade': 0.06, 'exponent': 1.0}, {'excess': 0.2, 'fade': 0.2}),
          Known('wave', 'transmission_error', 'mesh',
                {'order': 2.0, 'cosine': [1.5e-4, 3e-5], 'sine': [-8e-5, 2e-5]}),
          Known('teeth', 'cogging', 'motor', {'order': 24.0, 'cosine': [0.008],
                                              'sine': [0.005]})))

RV = Machine(
    name='rv_axis', about='Main axis of a robot for 165 kg: cycloid gear, encoder behind the gear',
    plant=Plant(
        ratio=121.0, rotor_inertia=5.5e-4, load_inertia=28.0, stiffness=3.5e5, damping=260.0,
        torque_constant=0.62, gain=1.5, motor_coulomb=0.11, motor_viscous=9e-4, load_coulomb=32.0,
        load_viscous=26.0, controller=SPEED_PI, kv=13.0, ki=150.0, filter=5e-4,
        motor_count=_counts(2**20), load_count=_counts(2**22), current_count=4e-3),
    torque=420.0, speed=1.6, acceleration=8.0, travel=2.8, period=5e-4, step=5e-5, jitter=2e-7,
    tolerance={**_AMPLIFIER, **_GEAR, **_FRICTION}, families=(*_ALL, 'chirp'), seconds=8.0,
    noise={'motor_position': 1e-5, 'load_position': 1e-6, 'current': 0.02},
    rich=(Known('breakaway', 'stribeck_friction', 'load',
                {'excess': 14.0, 'fade': 0.05, 'exponent': 1.0}, {'excess': 0.2, 'fade': 0.2}),
          Known('play', 'backlash', 'mesh', {'width': 2.5e-4}, {'width': 0.25}),
          Known('pins', 'transmission_error', 'mesh',
                {'order': 40.0, 'cosine': [3e-5], 'sine': [2e-5]})))

LEG = Machine(
    name='leg_actuator', about='Quasi-direct drive of a leg: planetary gear, impedance loop',
    plant=Plant(
        **_rigid(6e-5, 0.036, 9.0, 2500.0), torque_constant=0.09, gain=4.0, motor_coulomb=0.028,
        motor_viscous=1.2e-4, load_coulomb=0.32, load_viscous=0.03, controller=POSITION_LOOP,
        kp=40.0, kv=0.36, kf=1.0, filter=2e-3, motor_count=_counts(2**15), current_count=0.02),
    torque=14.0, speed=11.0, acceleration=150.0, travel=1.1, period=2e-3, step=4e-5, jitter=1e-6,
    tolerance={**_AMPLIFIER, **_INERTIAS, **_FRICTION}, rigid=True, hung=(8.0, 20.0),
    families=('speed_ladder', 'slow_reversals', 'load_steps', 'multisine', 'moves',
              'open_multisine'),
    noise={'motor_position': 1e-4, 'current': 0.06},
    rich=(Known('breakaway', 'stribeck_friction', 'load',
                {'excess': 0.2, 'fade': 0.3, 'exponent': 1.0}, {'excess': 0.2, 'fade': 0.2}),
          Known('shank', 'gravity', 'load', {'cosine': 0.0, 'sine': -2.4}, {'sine': 0.05}),
          Known('teeth', 'cogging', 'motor', {'order': 42.0, 'cosine': [0.012],
                                              'sine': [0.004]})))

SERVO = Machine(
    name='smart_servo', about='Hobby servo with a pendulum; all is counted at the output shaft',
    plant=Plant(
        **_rigid(0.012, 0.0079, 1.0, 1500.0), torque_constant=1.9, gain=1.0, resistance=5.2,
        inductance=1.5e-3, back_emf=1.9, motor_coulomb=0.03, motor_viscous=6e-3,
        load_coulomb=0.05, load_viscous=6e-3, controller=POSITION_LOOP, kp=42.0, kv=1.0, kd=0.0,
        limit=12.0, motor_count=_counts(4096)),
    torque=1.2, speed=3.2, acceleration=25.0, travel=1.5, period=5e-3, step=5e-5, jitter=1e-5,
    tolerance={**_WINDING, **_INERTIAS, **_FRICTION}, rigid=True, hung=(5.0, 12.0),
    families=('speed_ladder', 'slow_reversals', 'load_steps', 'multisine', 'moves',
              'open_multisine'),
    noise={'motor_position': 3e-4},
    plain=(Known('pendulum', 'gravity', 'load', {'cosine': 0.0, 'sine': -0.515},
                 {'sine': 0.04}),),
    rich=(Known('breakaway', 'stribeck_friction', 'load',
                {'excess': 0.05, 'fade': 0.12, 'exponent': 1.0}, {'excess': 0.2, 'fade': 0.2}),))

SCREW = Machine(
    name='screw_axis', about='Ball screw of 10 mm; its table of 180 kg, in turns of the screw',
    plant=Plant(
        ratio=1.0, rotor_inertia=1.2e-3, load_inertia=4.6e-4, stiffness=380.0, damping=0.035,
        torque_constant=0.6, gain=2.0, motor_coulomb=0.1, motor_viscous=4e-4, load_coulomb=0.16,
        load_viscous=7e-4, controller=POSITION_LOOP, kp=60.0, kv=0.42, ki=18.0, kf=1.0,
        filter=3e-4, heat=0.03, motor_count=_counts(2**20), load_count=_counts(100_000),
        current_count=2e-3),
    torque=3.2, speed=95.0, acceleration=900.0, travel=150.0, period=5e-4, step=2.5e-5,
    jitter=1e-7, tolerance={**_AMPLIFIER, **_GEAR, **_FRICTION}, families=(*_ALL, 'chirp'),
    seconds=8.0,
    noise={'motor_position': 5e-6, 'load_position': 1e-5, 'current': 0.012, 'temperature': 0.1},
    rich=(Known('wipers', 'stribeck_friction', 'load',
                {'excess': 0.08, 'fade': 2.0, 'exponent': 1.0}, {'excess': 0.2, 'fade': 0.2}),
          Known('play', 'backlash', 'mesh', {'width': 2e-3}, {'width': 0.25}),
          Known('lead', 'transmission_error', 'mesh',
                {'order': 1.0, 'cosine': [8e-4], 'sine': [-5e-4]})))

GIMBAL = Machine(
    name='gimbal', about='Pan axis of a camera: direct drive on a voltage, with cogging',
    plant=Plant(
        **_rigid(2e-4, 0.017, 1.0, 2500.0), torque_constant=0.32, gain=1.0, resistance=6.2,
        inductance=3.5e-3, back_emf=0.32, motor_coulomb=4e-3, motor_viscous=4e-4,
        load_coulomb=9e-3, load_viscous=1e-3, controller=SPEED_PI, kv=13.0, ki=110.0, filter=3e-3,
        limit=24.0, motor_count=_counts(2**17), current_count=8e-4),
    torque=0.3, speed=6.0, acceleration=12.0, travel=9.0, period=1e-3, step=4e-5, jitter=2e-6,
    tolerance={**_WINDING, **_INERTIAS, **_FRICTION}, rigid=True,
    families=('speed_ladder', 'slow_reversals', 'load_steps', 'multisine', 'moves', 'turns',
              'open_multisine'),
    noise={'motor_position': 2e-5, 'current': 4e-3},
    plain=(Known('cogs', 'cogging', 'motor',
                 {'order': 12.0, 'cosine': [6e-3, 1.5e-3], 'sine': [-4e-3, 1e-3]}),),
    rich=(Known('breakaway', 'stribeck_friction', 'load',
                {'excess': 7e-3, 'fade': 0.15, 'exponent': 1.0}, {'excess': 0.2, 'fade': 0.2}),
          Known('tilt', 'gravity', 'load', {'cosine': 0.012, 'sine': -0.03}, {'sine': 0.1})))

GEAR_MOTOR = Machine(
    name='gear_motor', about='Brushed motor, planetary gear, encoders before and behind it',
    plant=Plant(
        ratio=53.0, rotor_inertia=1.05e-6, load_inertia=4e-3, stiffness=220.0, damping=0.06,
        torque_constant=0.0235, gain=1.0, resistance=2.3, inductance=2.4e-4, back_emf=0.0235,
        motor_coulomb=7e-4, motor_viscous=4e-7, load_coulomb=0.04, load_viscous=4e-3,
        controller=SPEED_PI, kv=1.4, ki=14.0, filter=4e-3, limit=24.0, heat=0.5,
        motor_count=_counts(2000), load_count=_counts(2**17), current_count=3e-3),
    torque=1.0, speed=11.0, acceleration=60.0, travel=14.0, period=1e-3, step=2.5e-5, jitter=1e-6,
    tolerance={**_WINDING, **_GEAR, **_FRICTION}, families=(*_ALL, 'turns'),
    noise={'motor_position': 4e-4, 'load_position': 2e-5, 'current': 6e-3, 'temperature': 0.1},
    plain=(Known('play', 'backlash', 'mesh', {'width': 0.012}, {'width': 0.15}),),
    rich=(Known('breakaway', 'stribeck_friction', 'load',
                {'excess': 0.03, 'fade': 0.25, 'exponent': 1.0}, {'excess': 0.2, 'fade': 0.2}),
          Known('runout', 'transmission_error', 'mesh',
                {'order': 1.0, 'cosine': [2e-3], 'sine': [1e-3]})))

ANTENNA = Machine(
    name='antenna', about='Azimuth of a dish: planetary gear and pinion, loop and log at 100 Hz',
    plant=Plant(
        ratio=900.0, rotor_inertia=2.1e-3, load_inertia=4200.0, stiffness=6e6, damping=9e3,
        torque_constant=0.8, gain=1.0, motor_coulomb=0.22, motor_viscous=1.4e-3,
        load_coulomb=300.0, load_viscous=900.0, controller=CASCADE, kp=2.0, kv=90.0, ki=120.0,
        filter=5e-3, speed_limit=0.2, motor_count=_counts(2**14), load_count=_counts(2**20),
        current_count=3e-3),
    torque=2600.0, speed=0.1, acceleration=0.06, travel=1.2, period=1e-2, step=2e-4, jitter=4e-6,
    tolerance={**_AMPLIFIER, **_GEAR, **_FRICTION}, families=_ALL, seconds=45.0, hung=(1.2, 3.0),
    noise={'motor_position': 2e-4, 'load_position': 2e-6, 'current': 0.01},
    plain=(Known('play', 'backlash', 'mesh', {'width': 6e-4}, {'width': 0.2}),),
    rich=(Known('breakaway', 'stribeck_friction', 'load',
                {'excess': 180.0, 'fade': 3e-3, 'exponent': 1.0}, {'excess': 0.2, 'fade': 0.2}),))

MACHINES = {one.name: one for one in (JOINT, RV, LEG, SERVO, SCREW, GIMBAL, GEAR_MOTOR, ANTENNA)}


def told(name: str, style: str) -> Machine:
    """Return a machine as its servo file has it. Raises KeyError for an unknown machine."""
    machine = MACHINES[name]
    known = {'textbook': (), 'plain': machine.plain, 'rich': machine.plain + machine.rich}[style]
    gap = sum(one.values['width'] for one in known if one.effect == 'backlash')
    return replace(machine, known=known, plant=machine.plant._replace(gap=gap))
