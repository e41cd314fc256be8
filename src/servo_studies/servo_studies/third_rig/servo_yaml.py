"""The servo file of a machine: what its data sheets say, and how far each value may be off."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import yaml

from .plant import Plant, POSITION_LOOP, SPEED_PI
from .rig_machine import Machine

_UNITS = {'ratio': '', 'rotor_inertia': 'kg m2', 'load_inertia': 'kg m2', 'stiffness': 'N m/rad',
          'damping': 'N m s/rad', 'torque_constant': 'N m/A', 'resistance': 'ohm',
          'inductance': 'H', 'back_emf': 'V s/rad', 'level': 'N m', 'slope': 'N m s/rad',
          'excess': 'N m', 'fade': 'rad/s', 'width': 'rad', 'order': '1/rad'}
_SENSORS = {'motor_position': ('motor_encoder', 'rad'), 'load_position': ('load_encoder', 'rad'),
            'torque': ('torque_sensor', 'N m'), 'current': ('current_sensor', 'A')}
_DRIVE = ('gain', 'torque_constant', 'resistance', 'inductance', 'back_emf')
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
        section = 'drive' if name in _DRIVE else 'mechanism'
        yield _PATHS.get(name, f'{section}.{name}'), f'{100 * share:g} %'
    for one in machine.known:
        for name, share in one.tolerance.items():
            yield f'effects.{one.name}.{name}', f'{100 * share:g} %'
