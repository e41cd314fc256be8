"""
The diagnosis on a second rig: other laws, other machines, other excitations than the blind check.

    python tests/benchmarks/bench_second_rig.py SEED [--size 1.5] [--cases 56] [--case N ...]
                                                [--silent torque load_position]

Draws cases from SEED: one of three machines whose values are drawn about those of a class, what
its servo file lacks (--size times a tenth of the rated torque or wind-up, or what is as easily
seen), and four to six families of recordings of ten seconds, three replicates each, which
`diagnose` parts itself. Of eight cases four lack one thing and one lacks two, in two the true
cause is taken out of the catalogue or was never in it, in one nothing is lacking. --silent takes
channels away, and the cases that only they could show. Prints a line for each case and what they
come to; with --case those alone, with the warnings.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any
import zlib

import numpy as np
from second_rig import Machine, record

SECONDS = 10.0
REPLICATES = 3


@dataclass(frozen=True)
class Class:
    """A class of machines: typical values, what it is made for, and its tolerances."""

    machine: Machine
    torque: float  # N m at the load
    speed: float  # rad/s at the load
    tolerances: Mapping[str, float]


CLASSES = {
    'robot joint': Class(Machine(
        ratio=100.0, rotor_inertia=4e-5, load_inertia=0.5, stiffness=1.5e4, damping=4.0,
        torque_constant=0.09, gain=1.0, motor_coulomb=0.012, motor_viscous=6e-5, load_coulomb=1.5,
        load_viscous=1.0, kp=6.0, ki=60.0, position_gain=0.0, filter=0.0015, limit=10.0,
        creep=1.5e-4, period=1e-3, motor_count=2 * np.pi / 16384, load_count=2 * np.pi / 2**21,
        torque_noise=0.02, current_noise=0.004), 12.0, 2.5, {
            'gain': 0.02, 'torque_constant': 0.05, 'rotor_inertia': 0.1, 'load_inertia': 0.1,
            'stiffness': 0.15, 'damping': 0.6, 'load_coulomb': 0.15, 'load_viscous': 0.25,
            'motor_coulomb': 0.2, 'motor_viscous': 0.3}),
    'turntable': Class(Machine(
        ratio=25.0, rotor_inertia=3e-4, load_inertia=0.6, stiffness=9e3, damping=3.0,
        torque_constant=0.15, gain=1.0, motor_coulomb=0.03, motor_viscous=1e-4, load_coulomb=1.0,
        load_viscous=0.2, kp=16.0, ki=120.0, position_gain=6.0, filter=0.002, limit=48.0,
        creep=5e-4, period=1e-3, motor_count=2 * np.pi / 10000, load_count=2 * np.pi / 2**20,
        torque_noise=0.02, current_noise=0.01, resistance=0.7, inductance=1e-3,
        back_emf=0.15), 15.0, 6.0, {
            'gain': 0.01, 'resistance': 0.08, 'inductance': 0.2, 'back_emf': 0.04,
            'torque_constant': 0.04, 'rotor_inertia': 0.1, 'load_inertia': 0.08, 'stiffness': 0.15,
            'damping': 0.6, 'load_coulomb': 0.15, 'load_viscous': 0.3, 'motor_coulomb': 0.2,
            'motor_viscous': 0.3}),
    'gearmotor': Class(Machine(
        ratio=50.0, rotor_inertia=1.5e-6, load_inertia=4e-3, stiffness=80.0, damping=0.02,
        torque_constant=0.015, gain=1.0, motor_coulomb=6e-4, motor_viscous=5e-7,
        load_coulomb=0.03, load_viscous=2e-3, kp=1.2, ki=10.0, position_gain=0.0, filter=0.003,
        limit=12.0, creep=5e-4, period=1e-3, motor_count=2 * np.pi / 4096,
        load_count=2 * np.pi / 2**17, torque_noise=8e-4, current_noise=0.003, resistance=3.0,
        inductance=6e-4, back_emf=0.015, play=5e-3), 0.35, 6.0, {
            'gain': 0.01, 'resistance': 0.08, 'inductance': 0.2, 'back_emf': 0.05,
            'torque_constant': 0.05, 'rotor_inertia': 0.1, 'load_inertia': 0.05, 'stiffness': 0.15,
            'damping': 0.6, 'load_coulomb': 0.15, 'load_viscous': 0.3, 'motor_coulomb': 0.2,
            'motor_viscous': 0.3, 'play': 0.1}),
}


@dataclass(frozen=True)
class Lack:
    """
    Something that the servo file lacks.

    ``change(machine, torque, speed, size, rng)`` returns the properties that are other; ``names``
    are what it may be called, none for what the catalogue never had.
    """

    change: Callable[..., dict[str, float]]
    names: tuple[str, ...]
    site: str
    balances: tuple[str, ...]


def _lack(names: str, site: str, balances: str, change: Callable[..., dict[str, float]]) -> Lack:
    return Lack(change, tuple(names.split()), site, tuple(balances.split()))


LACKS = {
    'load_drag': _lack('coulomb_friction parameter:load_coulomb.level', 'load', 'load',
                       lambda m, t, v, s, r: {'load_coulomb': m.load_coulomb + 0.1 * s * t}),
    'motor_drag': _lack('coulomb_friction parameter:motor_coulomb.level', 'motor', 'motor',
                        lambda m, t, v, s, r: {
                            'motor_coulomb': m.motor_coulomb + 0.1 * s * t / m.ratio}),
    'load_viscous': _lack('viscous_friction parameter:load_viscous.slope', 'load', 'load',
                          lambda m, t, v, s, r: {
                              'load_viscous': m.load_viscous + 0.15 * s * t / v}),
    'stribeck_friction': _lack('stribeck_friction', 'load', 'load', lambda m, t, v, s, r: {
        'sticking': 0.12 * s * t, 'fade': r.uniform(0.02, 0.06) * v}),
    'presliding_friction': _lack('presliding_friction dahl_friction', 'load', 'load transmission',
                                 lambda m, t, v, s, r: {
                                     'bristle': 0.012 * s * r.uniform(0.7, 1.5)}),
    'asymmetric_friction': _lack('asymmetric_friction', 'load', 'load', lambda m, t, v, s, r: {
        'one_way': 0.15 * s * t}),
    'load_dependent_friction': _lack('load_dependent_friction', 'load', 'load',
                                     lambda m, t, v, s, r: {'by_load': 0.08 * s}),
    'position_dependent_friction': _lack('position_dependent_friction', 'load', 'load',
                                         lambda m, t, v, s, r: {
                                             'by_angle': 0.25 * s * t,
                                             'lobes': r.choice([1.0, 2.0])}),
    'quadratic_drag': _lack('quadratic_drag', 'load', 'load', lambda m, t, v, s, r: {
        'drag': 0.25 * s * t / v**2.1}),
    'friction_drift': _lack('friction_drift coulomb_friction parameter:load_coulomb.level',
                            'load', 'load', lambda m, t, v, s, r: {
                                'load_coulomb': m.load_coulomb + 0.04 * t, 'run_in': 0.8 * s,
                                'run_in_time': r.uniform(1.5, 4.0)}),
    'gravity': _lack('gravity', 'load', 'load', lambda m, t, v, s, r: {
        'weight': 0.12 * s * t, 'weight_angle': r.uniform(-1.0, 1.0)}),
    'spring_load': _lack('spring_load', 'load', 'load', lambda m, t, v, s, r: {
        'spring': 0.04 * s * t}),
    'payload_resonance': _lack('payload_resonance', 'load', 'load', lambda m, t, v, s, r: {
        'hung': 0.12 * s * m.load_inertia, 'hung_frequency': r.uniform(6.0, 14.0)}),
    'rotor_inertia': _lack('parameter:rotor_inertia', 'motor', 'motor',
                           lambda m, t, v, s, r: {
                               'rotor_inertia': m.rotor_inertia * (1 + 0.3 * s)}),
    'load_inertia': _lack('parameter:load_inertia', 'load', 'load transmission',
                          lambda m, t, v, s, r: {
                              'load_inertia': m.load_inertia * (1 + 0.25 * s)}),
    'torque_constant_error': _lack('torque_constant_error parameter:torque_constant', 'motor',
                                   'motor drive', lambda m, t, v, s, r: {
                                       'torque_constant': m.torque_constant * (1 - 0.12 * s)}),
    'torque_saturation': _lack('torque_saturation', 'motor', 'motor', lambda m, t, v, s, r: {
        'sinking': 0.7 * s**0.5 * m.ratio * m.torque_constant / t}),
    'torque_ripple': _lack('torque_ripple', 'motor', 'motor', lambda m, t, v, s, r: {
        'ripple': 0.12 * s, 'poles': r.choice([4., 12., 24.])}),
    'cogging': _lack('cogging', 'motor', 'motor', lambda m, t, v, s, r: {
        'cogging': 0.08 * s * t / m.ratio, 'poles': r.choice([4., 12., 24.])}),
    'current_lag': _lack('current_lag command_delay', '', 'drive', lambda m, t, v, s, r: {
        'lag': 0.0012 * s} if not m.resistance else {'inductance': m.inductance * (1 + 0.9 * s)}),
    'command_delay': _lack('command_delay current_lag', '', 'drive', lambda m, t, v, s, r: {
        'delay': min(0.0006 * s, m.period)}),
    'drive_dead_band': _lack('drive_dead_band', '', 'drive', lambda m, t, v, s, r: {
        'dead': 0.1 * s * _volts(m, t, v)}),
    'drive_saturation': _lack('drive_saturation', '', 'drive', lambda m, t, v, s, r: {
        'ceiling': _volts(m, t, v) * (m.gain if not m.resistance else 1.0) / (0.9 + 0.2 * s)}),
    'drive_gain': _lack('parameter:gain', '', 'drive', lambda m, t, v, s, r: {
        'gain': m.gain * (1 - 0.08 * s)}),
    'backlash': _lack('backlash', 'mesh', 'transmission',
                      lambda m, t, v, s, r: {'play': m.play + 0.4 * s * t / m.stiffness}),
    'load_dependent_backlash': _lack('load_dependent_backlash', 'mesh', 'transmission',
                                     lambda m, t, v, s, r: {
                                         'play_load': 0.5 * s * t / m.stiffness,
                                         'reach': 0.5 * t / m.stiffness}),
    'nonlinear_stiffness': _lack('nonlinear_stiffness', 'mesh', 'transmission',
                                 lambda m, t, v, s, r: {
                                     'soft': min(0.3 * s, 0.9), 'reach': 0.4 * t / m.stiffness}),
    'hysteresis': _lack('hysteresis dissipative_hysteresis', 'mesh', 'transmission',
                        lambda m, t, v, s, r: {
                            'loop': 0.1 * s * t, 'reach': r.uniform(0.05, 0.3) * t / m.stiffness}),
    'transmission_error': _lack('transmission_error', 'mesh', 'transmission',
                                lambda m, t, v, s, r: {
                                    'tooth': 0.06 * s * t / m.stiffness,
                                    'teeth': r.choice([1., 2., m.ratio])}),
    'stiffness_error': _lack('stiffness_error parameter:stiffness', 'mesh', 'transmission',
                             lambda m, t, v, s, r: {'stiffness': m.stiffness * (1 - 0.25 * s)}),
    'load_encoder_eccentricity': _lack('load_encoder_eccentricity transmission_error', '',
                                       'transmission sensor', lambda m, t, v, s, r: {
                                           'eccentric': 0.1 * s * t / m.stiffness}),
    'sensor_delay': _lack('sensor_delay', '', 'transmission sensor', lambda m, t, v, s, r: {
        'late': min(0.15 * s * t / m.stiffness / v, m.period)}),
    'torque_sensor_gain': _lack('torque_sensor_gain', '', 'motor load sensor',
                                lambda m, t, v, s, r: {'torque_gain': 1 + 0.12 * s}),
    'torque_sensor_offset': _lack('torque_sensor_offset', '', 'motor load sensor',
                                  lambda m, t, v, s, r: {'torque_zero': 0.08 * s * t}),
    'current_sensor_gain': _lack('current_sensor_gain parameter:resistance', '',
                                 'drive motor sensor', lambda m, t, v, s, r: {
                                     'current_gain': 1 - 0.1 * s}),
    'current_sensor_offset': _lack('current_sensor_offset', '', 'drive motor sensor',
                                   lambda m, t, v, s, r: {'current_zero': (
                                       0.08 * s * t / m.ratio / m.torque_constant)}),
    'controller_gain': _lack('controller_mismatch', '', 'controller',
                             lambda m, t, v, s, r: {'proportional': 1 + 0.2 * s}),
    'controller_integral': _lack('controller_mismatch', '', 'controller',
                                 lambda m, t, v, s, r: {'integral': 1 - min(0.25 * s, 0.9)}),
    'thinning': _lack('', 'load', 'load', lambda m, t, v, s, r: {
        'load_viscous': m.load_viscous + 0.6 * s * t / v, 'thin': 4.0 / v}),
    'cushion': _lack('', 'load', 'load', lambda m, t, v, s, r: {
        'cushion': 1.5 * s * t, 'cushion_angle': 0.4}),
    'supply': _lack('', '', 'drive', lambda m, t, v, s, r: {
        'supply': 0.3 * s * m.limit * m.ratio * m.torque_constant / t}),
    'slip': _lack('', '', 'transmission sensor', lambda m, t, v, s, r: {
        'slip': 0.1 * s / m.stiffness}),
}
ONLY = {'backlash': ('robot joint', 'turntable'), 'load_dependent_backlash': ('gearmotor',),
        'drive_gain': ('robot joint',), 'supply': ('turntable', 'gearmotor'),
        'controller_gain': ('robot joint', 'gearmotor')}


def _volts(m: Machine, torque: float, speed: float) -> float:
    """Return the command, V, for a torque at the load."""
    amperes = torque / m.ratio / m.torque_constant
    if m.resistance:
        return m.resistance * amperes + 0.5 * m.back_emf * m.ratio * speed
    return amperes / m.gain


@dataclass(frozen=True)
class Case:
    """One case: the class of machine, what it lacks, whether the catalogue has that, a seed."""

    number: int
    machine: str
    lacks: tuple[str, ...]
    removed: bool
    seed: int
    size: float
    silent: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What it lacks, for a person."""
        lacks = ' + '.join(self.lacks) or 'nothing'
        return f'{self.number:03d} {self.machine}, {lacks}{" (removed)" * self.removed}'

    @property
    def without(self) -> tuple[str, ...]:
        """What the catalogue shall not have."""
        return LACKS[self.lacks[0]].names if self.removed else ()


def cases(seed: int, size: float, count: int, silent: tuple[str, ...] = ()) -> list[Case]:
    """Draw cases; what is lacking comes in turn, in an order of its own."""
    rng = np.random.default_rng(seed)
    seen = {name: lack for name, lack in LACKS.items() if _shows(lack, name, silent)}
    known = [name for name, lack in seen.items() if lack.names]
    turns = {kind: _in_turn(rng, pool) for kind, pool in (
        ('single', known), ('pair', known),
        ('removed', [name for name, lack in seen.items() if not lack.names
                     or any(not other.startswith('parameter') for other in lack.names)]))}
    drawn = []
    for number in range(count):
        kind = ('single', 'removed', 'single', 'pair', 'single', 'removed', 'single',
                'nothing')[number % 8]
        lacks = () if kind == 'nothing' else (next(turns[kind]),)
        machines = [name for name in CLASSES if name in ONLY.get((*lacks, '')[0], CLASSES)]
        machine = str(rng.choice(machines))
        while kind == 'pair' and len(lacks) < 2:
            other = next(turns['pair'])
            if machine in ONLY.get(other, CLASSES) and _apart(lacks[0], other):
                lacks = (*lacks, other)
        drawn.append(Case(number, machine, lacks, kind == 'removed', int(rng.integers(2**31)),
                          size, silent))
    return drawn


def _shows(lack: Lack, name: str, silent: tuple[str, ...]) -> bool:
    """Tell whether channels that are left could show something."""
    if 'torque' in silent and name.startswith('torque_sensor'):
        return False
    return 'load_position' not in silent or lack.balances[0] != 'transmission'


def _in_turn(rng: np.random.Generator, pool: list[str]) -> Iterator[str]:
    while True:
        yield from (str(one) for one in rng.permutation(pool))


def _apart(one: str, other: str) -> bool:
    """Tell whether two things have neither names nor properties in common."""
    if set(LACKS[one].names) & set(LACKS[other].names):
        return False
    of, rng = CLASSES['robot joint'], np.random.default_rng(0)
    properties = [set(LACKS[name].change(of.machine, of.torque, of.speed, 1.0, rng))
                  for name in (one, other)]
    return not properties[0] & properties[1]


def make(case: Case) -> tuple[Machine, list[tuple[str, int, dict[str, np.ndarray]]]]:
    """Return (what the servo file says, recordings of the rig: family, replicate, columns)."""
    rng = np.random.default_rng(case.seed)
    of = CLASSES[case.machine]
    about = {name: getattr(of.machine, name) * float(np.exp(rng.uniform(-0.3, 0.3)))
             for name in of.tolerances if name not in ('gain', 'back_emf')}
    if of.machine.resistance:
        about['back_emf'] = about['torque_constant']
    told = of.machine._replace(**about)
    reach = 0.25 if case.lacks else 0.9
    rig = told._replace(**{name: getattr(told, name) * (1 + reach * share * rng.uniform(-1, 1))
                           for name, share in of.tolerances.items()})
    for lack in case.lacks:
        rig = rig._replace(**LACKS[lack].change(rig, of.torque, of.speed, case.size, rng))
    families = ['ladder', 'reversals', 'multisine', *rng.choice(
        ['load_steps', 'chirp', 'turns', 'moves', 'steps'], rng.integers(1, 4), replace=False)]
    made = []
    for family in families:
        settings = np.random.default_rng(rng.integers(2**31))
        position, speed, external = motion(str(family), of, told, settings)
        made += [(str(family), n, record(rig, position, speed, external, int(rng.integers(2**31))))
                 for n in range(1, REPLICATES + 1)]
    return told, made


def motion(family: str, of: Class, machine: Machine, rng: np.random.Generator
           ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return reference position (rad), speed (rad/s), external torque (N m), each (samples,)."""
    t = np.arange(round(SECONDS / machine.period)) * machine.period
    top, external = of.speed * rng.uniform(0.6, 1.0), np.zeros(len(t))
    hardest = 0.7 * of.torque / (machine.load_inertia + machine.rotor_inertia * machine.ratio**2)
    if family == 'ladder':
        rungs = top * np.geomspace(0.03, 1.0, 5)
        speed = np.repeat(np.column_stack((rungs, -rungs)).ravel(), len(t) // 10)
    elif family == 'reversals':
        period = rng.uniform(2.0, 5.0)
        speed = 0.04 * top * np.sign(np.sin(2 * np.pi * t / period))
    elif family == 'load_steps':
        speed = 0.15 * top * np.where(t < 0.5 * SECONDS, 1.0, -1.0)
        steps = np.array([0.0, 0.5, 1.0, 0.3, -0.5, -1.0]) * of.torque * rng.uniform(0.3, 0.6)
        external = steps[(t / 0.8).astype(int) % len(steps)]
    elif family in ('multisine', 'chirp'):
        first, last = rng.uniform(0.2, 0.5), rng.uniform(12.0, 25.0)
        if family == 'chirp':
            phase = 2 * np.pi * first * SECONDS / np.log(last / first) * (
                (last / first)**(t / SECONDS) - 1.0)
            speed, rate = np.sin(phase), first * (last / first)**(t / SECONDS)
            speed = speed * np.minimum(0.4 * top, hardest / (2 * np.pi * rate))
        else:
            lines = np.unique(np.round(np.geomspace(first, last, 25) * SECONDS) / SECONDS)
            size = np.minimum(0.4 * top, hardest / (2 * np.pi * lines))
            speed = 0.35 * np.sum(size[:, None] * np.sin(
                2 * np.pi * lines[:, None] * t + rng.uniform(0, 2 * np.pi, (len(lines), 1))), 0)
    elif family == 'turns':
        speed = 0.5 * top * np.where(t < 0.5 * SECONDS, 1.0, -1.0)
    elif family == 'moves':
        speed = np.zeros(len(t))
        at = 0.3
        while at < SECONDS - 1.5:
            length, size = rng.uniform(0.5, 1.4), rng.uniform(-0.8, 0.8) * top
            speed += size * np.sin(np.pi * np.clip((t - at) / length, 0.0, 1.0))**2
            at += length + rng.uniform(0.1, 0.4)
    else:
        level = rng.uniform(-0.6, 0.6, 13) * top
        speed = level[np.minimum((t / 0.8).astype(int), 12)]
    speed = np.concatenate((speed, np.full(len(t) - len(speed), speed[-1])))[:len(t)]
    if family not in ('multisine', 'chirp', 'moves'):
        speed = _limited(speed, hardest * machine.period)
    position = np.concatenate(([0.0], np.cumsum(speed[:-1]) * machine.period))
    return position, speed, external


def _limited(speed: np.ndarray, most: float) -> np.ndarray:
    """Let a speed change by at most so much from sample to sample."""
    out, now = np.empty_like(speed), 0.0
    for k, wanted in enumerate(speed):
        now += min(max(wanted - now, -most), most)
        out[k] = now
    return out


def servo_of(case: Case, told: Machine) -> dict[str, Any]:
    """Return the servo file of a machine as it is told, as a mapping."""
    of = CLASSES[case.machine]

    def value(number: float, unit: str = '') -> dict[str, Any]:
        return {'value': float(number), **({'unit': unit} if unit else {}), 'source': 'data sheet'}

    drive = {'type': 'current', 'gain': value(told.gain, 'A/V')}
    if told.resistance:
        drive = {'type': 'voltage', 'gain': value(told.gain, 'V/V'),
                 'resistance': value(told.resistance, 'ohm'),
                 'inductance': value(told.inductance, 'H'),
                 'back_emf': value(told.back_emf, 'V s/rad')}
    controller = {'type': 'velocity_pi', 'kp': value(told.kp, 'V s/rad')}
    if told.position_gain:
        controller = {'type': 'position_loop', 'kp': value(told.position_gain, '1/s'),
                      'kv': value(told.kp, 'V s/rad'), 'kd': value(1.0), 'kf': value(1.0)}
    effects = {
        'load_coulomb': {'effect': 'coulomb_friction', 'at': 'load',
                         'level': value(told.load_coulomb, 'N m')},
        'load_viscous': {'effect': 'viscous_friction', 'at': 'load',
                         'slope': value(told.load_viscous, 'N m s/rad')},
        'motor_coulomb': {'effect': 'coulomb_friction', 'at': 'motor',
                          'level': value(told.motor_coulomb, 'N m')},
        'motor_viscous': {'effect': 'viscous_friction', 'at': 'motor',
                          'slope': value(told.motor_viscous, 'N m s/rad')}}
    if told.play:
        effects['play'] = {'effect': 'backlash', 'at': 'mesh', 'width': value(told.play, 'rad')}
    where = {'load_coulomb': 'effects.load_coulomb.level', 'play': 'effects.play.width',
             'load_viscous': 'effects.load_viscous.slope',
             'motor_coulomb': 'effects.motor_coulomb.level',
             'motor_viscous': 'effects.motor_viscous.slope'}
    for name in ('gain', 'resistance', 'inductance', 'back_emf', 'torque_constant'):
        where[name] = f'drive.{name}'
    return {
        'servo': case.machine.replace(' ', '_'), 'step': 5e-5,
        'drive': {**drive, 'torque_constant': value(told.torque_constant, 'N m/A')},
        'mechanism': {'type': 'two_inertia', 'rotor_inertia': value(told.rotor_inertia, 'kg m2'),
                      'load_inertia': value(told.load_inertia, 'kg m2'),
                      'ratio': value(told.ratio), 'stiffness': value(told.stiffness, 'N m/rad'),
                      'damping': value(told.damping, 'N m s/rad')},
        'controller': {**controller, 'ki': value(told.ki, 'V/rad'),
                       'filter': value(told.filter, 's'), 'limit': value(told.limit, 'V')},
        'sensors': {name: {'noise': noise} for name, channel, noise in (
            ('motor_encoder', 'motor_position', value(0.42 * told.motor_count, 'rad')),
            ('load_encoder', 'load_position', value(0.42 * told.load_count, 'rad')),
            ('torque_sensor', 'torque', value(told.torque_noise, 'N m')),
            ('current_sensor', 'current', value(told.current_noise, 'A')),
            ('voltage_sensor', 'voltage', value(1e-6, 'V'))) if channel not in case.silent},
        'effects': effects,
        'tolerance': {where.get(name, f'mechanism.{name}'): f'{100 * share:g} %'
                      for name, share in of.tolerances.items()}}


def diagnosed(case: Case) -> tuple[Case, str, list[str]]:
    """Return (case, what its diagnosis comes to, what it said)."""
    import tempfile

    import yaml

    from servo_identify.gap.checks import CannotDiagnose
    from servo_identify.gap.diagnose import diagnose
    from servo_twin import servo_file
    from servo_twin.recording import Recording

    told, made = make(case)
    with tempfile.NamedTemporaryFile('w', suffix='.yaml') as file:
        yaml.safe_dump(servo_of(case, told), file)
        file.flush()
        servo = servo_file.load(file.name)
    recordings = [Recording(
        f'{family}-{n}', told.period,
        {name: np.ascontiguousarray(column) for name, column in columns.items()
         if name not in case.silent}, family=family, replicate=n, servo=servo.name,
        digest=f'{zlib.crc32(f"{case.seed} {family} {n} {case.silent}".encode()):064x}')
        for family, n, columns in made]
    try:
        report = diagnose(recordings, servo, without=case.without).report
    except CannotDiagnose as problem:
        return case, 'failed', [str(problem)]
    said = [' or '.join((f'{one.effect} ({one.site})', *one.ambiguous_with))
            for one in report.which]
    lines = [f"{report.verdict['status']}: {'; '.join(said)}", *report.warnings]
    return case, outcome(case, report), lines


def outcome(case: Case, report: Any) -> str:
    """Return in a word what a report says of a case."""
    status = report.verdict['status']
    named = [(one.effect, one.site or '', one.ambiguous_with) for one in report.which]
    known = [LACKS[lack] for lack in case.lacks if LACKS[lack].names and not case.removed]
    if not named:
        nothing = {'no_gap': 'right', 'unknown': 'unknown'}[status]
        return ({'no_gap': 'unseen', 'unknown': 'unknown' if known else 'right'}[status]
                if case.lacks else nothing)
    if not known:
        flagged = ', flagged' if status == 'partly_explained' else ''
        return f'wrong{flagged}' if case.lacks else 'false'
    def is_(one: tuple[str, str, Any], lack: Lack) -> bool:
        sided = lack.site and 'torque' not in case.silent  # which shaft it brakes, it alone tells
        return one[0] in lack.names and (not sided or one[1] in ('', lack.site))

    right = [any(is_(one, lack) for lack in known) for one in named]
    if all(right):
        whole = all(any(is_(one, lack) for one in named) for lack in known)
        return 'right' if whole else 'a part'
    if right[0]:
        return 'right and more'
    held = {other.partition(' (')[0] for other in named[0][2]}
    return 'in set' if any(held & set(lack.names) for lack in known) else 'wrong'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('seed', type=int)
    parser.add_argument('--size', type=float, default=1.5)
    parser.add_argument('--cases', type=int, default=56)
    parser.add_argument('--case', type=int, nargs='+', default=[])
    parser.add_argument('--silent', nargs='+', default=[], choices=('torque', 'load_position'))
    told = parser.parse_args()
    drawn = cases(told.seed, told.size, told.cases, tuple(told.silent))
    seen: Counter[tuple[str, str]] = Counter()
    with ProcessPoolExecutor() as pool:
        for case, word, lines in pool.map(diagnosed, [drawn[n] for n in told.case] or drawn):
            kind = ('nothing' if not case.lacks else 'pair' if len(case.lacks) > 1 else
                    'removed' if case.removed else 'single')
            seen[kind, word] += 1
            print(f'{word:<15}{case.name:<60} {lines[0]}', flush=True)
            for line in lines[1:] if told.case else ():
                print(f'{"":<15}{line}')
    for (kind, word), number in sorted(seen.items()):
        print(f'{kind:<10}{word:<15}{number}')


if __name__ == '__main__':
    main()
