"""What would tell two effects apart, and how to confirm one by hand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from servo_twin.physics.servo import Servo

from ..mechanisms.values import name_of
from .report import MissingEffect

SHOWN_BY = {
    'coulomb_friction': 'slow triangles both ways: a step with the sign of speed',
    'viscous_friction': 'a ladder of speeds both ways',
    'stribeck_friction': 'a ladder of slow speeds both ways',
    'presliding_friction': 'slow reversals of small travel',
    'asymmetric_friction': 'the same speed in both directions',
    'load_dependent_friction': 'steps of load at constant speed, driving and back-driven',
    'position_dependent_friction': 'slow full turns in both directions',
    'quadratic_drag': 'the highest speeds of the ladder',
    'eddy_brake': 'a ladder of speeds: it has a peak and falls beyond, and is none at rest',
    'friction_drift': 'the same motion repeated as the machine warms up',
    'cogging': 'slow turns without current: it does not change with the load',
    'torque_ripple': 'slow turns under two loads: it grows with the current',
    'torque_constant_error': 'a known load on the output',
    'torque_saturation': 'large currents in both directions: it has no loop',
    'current_sensor_offset': 'standstill without current',
    'current_sensor_gain': 'a second ammeter',
    'constant_torque': 'standstill without current: it pushes where friction rests',
    'gravity': 'the load held half a turn on: it pulls the other way',
    'relaxing_spring': 'a quick move and a rest after it: the torque fades while nothing moves',
    'spring_load': 'the load held ever further from its rest: it pulls ever harder',
    'current_lag': 'a chirp: its gain falls with frequency',
    'command_delay': 'a chirp: its phase falls in proportion to frequency, its gain does not',
    'torque_speed_limit': 'the same large command at standstill and at speed: only at speed is '
                          'current missing',
    'braking_power_limit': 'hard stops from several speeds: only from high speed do they take '
                           'longer than asked',
    'command_rate_limit': 'jumps of the command, small and large: only the large ones are late',
    'supply_sag': 'large currents at standstill and at speed: volts are missing where both the '
                  'current and the command are large',
    'drive_dead_band': 'small commands: the current does not answer',
    'drive_saturation': 'the largest commands',
    'stiffness_error': 'a ladder of loads at standstill',
    'nonlinear_stiffness': 'a ladder of loads through zero: the torsion bends and does not jump',
    'backlash': 'reversals of the load: the torsion jumps',
    'load_dependent_backlash': 'reversals under several loads',
    'position_dependent_backlash': 'reversals at several angles',
    'hysteresis': 'loads up and down: the loop stays at rest',
    'viscoelasticity': 'a step of the load that is held: the torsion creeps on',
    'slip': 'turns under a load, one way: the two encoders part and stay apart',
    'transmission_error': 'slow turns under two loads: it stays the same',
    'load_encoder_eccentricity': 'a turn of the load: the torque stays clean',
    'sensor_lag': 'a chirp: the reading falls with frequency where the quantity does not',
    'sensor_delay': 'two speeds: the error grows with speed',
    'clock_drift': 'one quick move at the start and one at the end: the second is later',
    'torque_sensor_gain': 'a known load on the output',
    'torque_sensor_offset': 'the load taken off',
    'torque_sensor_inertia': 'quick moves without load: the reading lacks torque as they speed up',
    'torque_sensor_hysteresis': 'known loads up and down: the reading alone has a loop',
    'motor_encoder_eccentricity': 'slow turns of the motor: it stays the same under any load',
    'external_torque': 'standstill: it goes on while the axis rests',
    'payload_resonance': 'a chirp: the load shaft alone shows the resonance',
    'controller_mismatch': 'the same reference in open loop',
}
"""The excitation that shows an effect (GAP_METHOD.md, signatures)."""

BY_ITSELF = {
    'drive.resistance': 'an ohmmeter at the winding, the motor at rest',
    'drive.gain': 'a voltmeter (or an ammeter) at the output of the drive under a known command',
    'drive.back_emf': 'a voltmeter at the open winding, the motor turned at a known speed',
    'drive.torque_constant': 'a known current at rest, and a weight on a lever',
    'mechanism.stiffness': 'the motor locked, a known load on the output, its angle read',
    'mechanism.ratio': 'the turns of the motor counted over ten turns of the output',
}
"""What measures a value of the servo file by itself, by its path."""


def tell(one: str, other: str) -> str:
    """Return what would tell two effects apart, in a sentence."""
    said = []
    for name in (one, other):
        if name in SHOWN_BY:
            said.append(f'{name.replace("_", " ")} shows in {SHOWN_BY[name]}')
        elif name.startswith('parameter:'):
            said.append(f'{name.removeprefix("parameter:")} can be measured by itself')
    return '; '.join(said) + '.' if said else ''


def confirmations(which: Sequence[MissingEffect], servo: Servo) -> Iterator[str]:
    """Yield how to confirm an effect by hand, where a meter, a weight or a look will do."""
    for one in which:
        torque, angle = (servo.reads(unit, one.site) for unit in ('N m', 'rad'))
        values = {name: p['value'] for name, p in one.parameters.items()}
        if one.effect == 'coulomb_friction' and 'level' in values:
            yield (f'Drive off, turn the {one.site} shaft slowly by hand: it resists with '
                   f'{values["level"]:.3g} {torque} either way.')
        elif one.effect == 'gravity' and {'cosine', 'sine'} <= set(values):
            cosine, sine = (0.0 if abs(p['value']) <= (p['std'] or 0.0) else p['value']
                            for p in (one.parameters['cosine'], one.parameters['sine']))
            yield (f'Hold the load at 0 {angle}: gravity is {cosine:.3g} {torque} there, and '
                   f'{sine:.3g} {torque} a quarter turn on.')
        elif one.effect == 'spring_load' and 'stiffness' in values:
            yield (f'Hold the load 0.1 {angle} away from its rest: '
                   f'{0.1 * values["stiffness"]:.3g} {torque}.')
        elif one.effect == 'backlash' and 'width' in values:
            yield (f'Hold the motor, move the load to and fro by hand: it moves freely by '
                   f'{values["width"]:.3g} {angle}.')
    yield from _by_itself(which, servo)


def _by_itself(which: Sequence[MissingEffect], servo: Servo) -> Iterator[str]:
    """Yield how to measure the values that may be off: those named, and what rivals them."""
    names = dict.fromkeys(name for one in which for name in (one.effect, *one.ambiguous_with))
    told = {(one.effect, name): p['value'] for one in which
            for name, p in one.parameters.items()}
    declared = dict(servo.declarations())
    several = {name_of(path): path for path in BY_ITSELF if path in servo.numbers}
    for name, path in ((name, several[name]) for name in names if name in several):
        value = path.rpartition('.')[2]
        unit = servo.reads(declared[path].unit, path)
        known = told.get((name, value))  # of that name alone: a spring has a stiffness as well
        found = '' if known is None else f', this diagnosis {known:.3g} {unit}'.rstrip()
        yield (f'Measure the {value.replace("_", " ")} by itself: {BY_ITSELF[path]}. The servo '
               f'file has {servo.numbers[path]:.3g} {unit}'.rstrip() + found + '.')
