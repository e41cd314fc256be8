"""The machines of the second rig: what they are, what their servo files say and may lack."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from second_rig import Machine


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

    @property
    def accepted(self) -> frozenset[str]:
        """All names that count as right, as a fault of the blind check has them."""
        return frozenset(self.names)


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
    'current_lag': _lack('current_lag command_delay parameter:inductance', '', 'drive',
                         lambda m, t, v, s, r: {'lag': 0.0012 * s} if not m.resistance else {
                             'inductance': m.inductance * (1 + 0.9 * s)}),
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


def servo_of(name: str, told: Machine, silent: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the servo file of a machine of a class as it is told, without some channels."""
    of = CLASSES[name]

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
    for one in ('gain', 'resistance', 'inductance', 'back_emf', 'torque_constant'):
        where[one] = f'drive.{one}'
    return {
        'servo': name.replace(' ', '_'), 'step': 5e-5,
        'drive': {**drive, 'torque_constant': value(told.torque_constant, 'N m/A')},
        'mechanism': {'type': 'two_inertia', 'rotor_inertia': value(told.rotor_inertia, 'kg m2'),
                      'load_inertia': value(told.load_inertia, 'kg m2'),
                      'ratio': value(told.ratio), 'stiffness': value(told.stiffness, 'N m/rad'),
                      'damping': value(told.damping, 'N m s/rad')},
        'controller': {**controller, 'ki': value(told.ki, 'V/rad'),
                       'filter': value(told.filter, 's'), 'limit': value(told.limit, 'V')},
        'sensors': {sensor: {'noise': noise} for sensor, channel, noise in (
            ('motor_encoder', 'motor_position', value(0.42 * told.motor_count, 'rad')),
            ('load_encoder', 'load_position', value(0.42 * told.load_count, 'rad')),
            ('torque_sensor', 'torque', value(told.torque_noise, 'N m')),
            ('current_sensor', 'current', value(told.current_noise, 'A')),
            ('voltage_sensor', 'voltage', value(1e-6, 'V'))) if channel not in silent},
        'effects': effects,
        'tolerance': {where.get(one, f'mechanism.{one}'): f'{100 * share:g} %'
                      for one, share in of.tolerances.items()}}
