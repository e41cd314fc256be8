"""
The machines of the third rig: what they are, how they are asked to move, and their servo files.

A servo file says what the data sheets say; the machine itself is drawn within its tolerances. It
comes in three styles: `textbook` has inertias, gear, drive, loop, Coulomb and viscous friction;
`plain` has what the class is known for as well (a pendulum, a gap, cogging); `rich` has more.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import yaml

from .fault_terms import Change, Scale
from .integrator import CASCADE, Plant, POSITION_LOOP, SPEED_PI

STYLES = ('textbook', 'plain', 'rich')


@dataclass(frozen=True)
class Known:
    """An effect that the servo file has: right, or within the share that is tolerated."""

    name: str
    effect: str
    site: str
    values: dict[str, Any]
    tolerance: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Machine:
    """A class of machines, or one of them."""

    name: str
    about: str
    plant: Plant
    torque: float                # N m at the load, rated
    speed: float                 # rad/s at the load, highest
    acceleration: float          # rad/s2 at the load
    travel: float                # rad to either side
    period: float                # s
    step: float                  # s, of the integrator
    tolerance: dict[str, float]  # share of each property of the plant
    noise: dict[str, float]      # of each sensor that it has, before the counts
    jitter: float                # s
    families: tuple[str, ...]
    seconds: float = 10.0        # of a recording
    rigid: bool = False
    hung: tuple[float, float] = (6.0, 15.0)
    plain: tuple[Known, ...] = ()
    rich: tuple[Known, ...] = ()
    known: tuple[Known, ...] = field(default=())

    @property
    def channels(self) -> tuple[str, ...]:
        """What it measures beside the command."""
        return tuple(self.noise)

    @property
    def has(self) -> frozenset[str]:
        """Return what mechanisms may ask for."""
        p = self.plant
        return frozenset(one for one, there in {
            'compliant': not self.rigid, 'load': 'load_position' in self.noise,
            'torque': 'torque' in self.noise, 'current': 'current' in self.noise,
            'temperature': 'temperature' in self.noise, 'voltage_drive': p.resistance > 0.0,
            'current_drive': p.resistance == 0.0, 'coulomb': True, 'closed': True,
            'external': 'load_steps' in self.families}.items() if there)

    def scale(self, site: str, way: float = 1.0) -> Scale:
        """Return the sizes that its faults at a site are counted in, more or less."""
        orders = tuple(one.values['order'] for one in self.known if 'order' in one.values)
        return Scale(self.plant, site, way, self.torque, self.speed, self.travel, self.seconds,
                     self.hung, orders)

    def sensor_noise(self, channel: str) -> float:
        """Return the noise of a channel with that of its counts and instants, rms."""
        p = self.plant
        count = {'motor_position': p.motor_count, 'load_position': p.load_count,
                 'torque': p.torque_count, 'current': p.current_count}.get(channel, 0.0)
        moved = {'motor_position': p.ratio, 'load_position': 1.0}.get(channel, 0.0)
        return float(np.sqrt(self.noise[channel]**2 + count**2 / 12
                             + (0.3 * moved * self.speed * self.jitter)**2))


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


def within_tolerance(machine: Machine, chance: np.random.Generator) -> Machine:
    """Return one machine of a class: each value drawn within 0.8 of its tolerance."""
    def about(value: float, share: float) -> float:
        return value * (1.0 + share * chance.uniform(-0.8, 0.8))

    p = machine.plant
    values = {name: about(getattr(p, name), share) for name, share in machine.tolerance.items()}
    if p.back_emf:  # one flux makes both
        values['back_emf'] = p.back_emf * values['torque_constant'] / p.torque_constant
    known = tuple(replace(one, values=one.values | {
        name: about(one.values[name], share) for name, share in one.tolerance.items()})
        for one in machine.known)
    values['gap'] = sum(one.values['width'] for one in known if one.effect == 'backlash')
    return replace(machine, plant=p._replace(**values), known=known)


def known_effects(machine: Machine) -> Change:
    """Return what the effects of the servo file do, in terms of this rig."""
    whole = Change()
    for one in machine.known:
        m, v = machine.scale('load' if one.site == 'mesh' else one.site), one.values
        if one.effect == 'stribeck_friction':
            whole += m.resists(v['excess'] / m.torque, speed=lambda x, m=m, v=v: np.exp(
                -(x * m.speed / v['fade'])**v['exponent']))
        elif one.effect in ('cogging', 'transmission_error', 'gravity'):
            port = {'cogging': 'motor_torque', 'gravity': 'load_torque'}.get(
                one.effect, 'load_error')
            waves = list(zip(np.atleast_1d(v['cosine']), np.atleast_1d(v['sine']), strict=True))
            whole += m.adds(port, m.turn(lambda p, waves=waves: sum(
                c * np.cos(k * p) + s * np.sin(k * p) for k, (c, s) in enumerate(waves, 1)),
                v.get('order', 1.0)))
    return whole


_UNITS = {'ratio': '', 'rotor_inertia': 'kg m2', 'load_inertia': 'kg m2', 'stiffness': 'N m/rad',
          'damping': 'N m s/rad', 'torque_constant': 'N m/A', 'resistance': 'ohm',
          'inductance': 'H', 'back_emf': 'V s/rad', 'level': 'N m', 'slope': 'N m s/rad',
          'excess': 'N m', 'fade': 'rad/s', 'width': 'rad', 'order': '1/rad'}
_SENSORS = {'motor_position': ('motor_encoder', 'rad'), 'load_position': ('load_encoder', 'rad'),
            'torque': ('torque_sensor', 'N m'), 'current': ('current_sensor', 'A')}
_PATHS = {'motor_coulomb': 'effects.motor_coulomb.level',
          'motor_viscous': 'effects.motor_viscous.slope',
          'load_coulomb': 'effects.load_coulomb.level',
          'load_viscous': 'effects.load_viscous.slope'}


def servo_file(machine: Machine) -> str:
    """Return the servo file of a machine as it is told, as YAML."""
    p = machine.plant

    def value(number: Any, unit: str = '', source: str = 'data sheet') -> dict[str, Any]:
        number = [float(one) for one in number] if isinstance(number, list) else float(number)
        return {'value': number, **({'unit': unit} if unit else {}), 'source': source}

    def of(*names: str) -> dict[str, Any]:
        return {name: value(getattr(p, name), _UNITS[name]) for name in names}

    winding = ('resistance', 'inductance', 'back_emf') if p.resistance else ()
    gear = () if machine.rigid else ('stiffness', 'damping')
    effects = {name: {'effect': effect, 'at': name.split('_')[0],
                      kind: value(getattr(p, name), _UNITS[kind])}
               for name, effect, kind in (
                   ('motor_coulomb', 'coulomb_friction', 'level'),
                   ('motor_viscous', 'viscous_friction', 'slope'),
                   ('load_coulomb', 'coulomb_friction', 'level'),
                   ('load_viscous', 'viscous_friction', 'slope'))}
    for one in machine.known:
        wave = 'rad' if one.effect == 'transmission_error' else 'N m'
        effects[one.name] = {'effect': one.effect, 'at': one.site, **{
            name: value(what, _UNITS.get(name, wave if name in ('cosine', 'sine') else ''))
            for name, what in one.values.items()}}
    noise = {_SENSORS[channel][0]: {'noise': value(
        machine.sensor_noise(channel), _SENSORS[channel][1], 'resolution and scatter')}
        for channel in machine.noise if channel in _SENSORS}
    noise['voltage_sensor'] = {'noise': value(1e-6, 'V', 'the command is known')}
    tree = {
        'servo': machine.name, 'step': min(5e-5, machine.period / 10),
        'drive': {'type': 'voltage' if p.resistance else 'current',
                  'gain': value(p.gain, 'V/V' if p.resistance else 'A/V'),
                  **of(*winding, 'torque_constant')},
        'mechanism': {'type': 'rigid' if machine.rigid else 'two_inertia',
                      **of('rotor_inertia', 'load_inertia', 'ratio', *gear)},
        'controller': _loop(p, lambda number, unit: value(number, unit, 'setting')),
        'sensors': noise, 'effects': effects,
        'tolerance': dict(_tolerances(machine))}
    return f'# {machine.about}.\n' + yaml.safe_dump(tree, sort_keys=False, width=98)


def _loop(p: Plant, value: Any) -> dict[str, Any]:
    """Return the controller of a servo file."""
    loop = {'ki': value(p.ki, 'V/rad'), 'filter': value(p.filter, 's'),
            'limit': value(p.limit, 'V')}
    if p.controller == SPEED_PI:
        return {'type': 'velocity_pi', 'kp': value(p.kv, 'V s/rad'), **loop}
    loop |= {'kp': value(p.kp, '1/s'), 'kv': value(p.kv, 'V s/rad')}
    if p.controller == POSITION_LOOP:
        return {'type': 'position_loop', **loop, 'kd': value(p.kd, ''), 'kf': value(p.kf, '')}
    return {'type': 'cascade', **loop, 'speed_limit': value(p.speed_limit, 'rad/s')}


def _tolerances(machine: Machine) -> Iterator[tuple[str, Any]]:
    """Yield the paths of a servo file and what of them may be off."""
    shares = dict(machine.tolerance)
    if machine.plant.back_emf:
        shares['back_emf'] = shares['torque_constant']
    for name, share in shares.items():
        section = 'drive' if name in (*_AMPLIFIER, *_WINDING, 'back_emf') else 'mechanism'
        yield _PATHS.get(name, f'{section}.{name}'), f'{100 * share:g} %'
    for one in machine.known:
        for name, share in one.tolerance.items():
            yield f'effects.{one.name}.{name}', f'{100 * share:g} %'
