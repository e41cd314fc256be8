"""A simulator's joint as a servo: each value with where it comes from."""

from __future__ import annotations

from math import inf, sqrt

from ...description.nearest_name import or_what
from ...description.servo_file import dumps
from ...physics.controllers import Impedance, Open
from ...physics.mechanisms.rigid import Rigid
from ...physics.servo import Provenance, SENSORS, Servo, ServoError
from ..joint import Joint, ModelError
from .as_drive import drive_of
from .required_values import Given, ratio_of, with_given
from .sourced_values import FoundValues

STEP = 1e-4  # s
NO_SENSORS = ('No sensors: a diagnosis needs the noise of each channel that is recorded, such as '
              '--noise motor_position=2e-4')
_CONSTANT = 0.01  # 1/m, the least order of gravity: over a metre it is constant within 5e-5
_SENSOR_OF = {sensor.channel: sensor for sensor in SENSORS.values()}


def servo_of(joint: Joint, name: str, given: Given | None = None) -> tuple[Servo, list[str]]:
    """
    Return a joint as a servo, and what the servo lacks of it, a sentence each.

    What the simulator does not hold is taken from ``given`` or is so by definition, and the
    provenance says which. Raises ModelError where something is missing or there twice.
    """
    given = given or Given()
    joint = with_given(joint, given)
    found, lacking = FoundValues(), list(joint.left_out)
    ratio, ratio_said = ratio_of(joint, given)
    if not joint.inertia + joint.armature > 0.0:
        raise ModelError(f'joint {joint.name!r} carries no mass and has no armature: nothing '
                         f'would resist its torque')
    found.put('mechanism.rotor_inertia', joint.armature / ratio**2,
              _armature_said(joint, ratio), read=joint.armature > 0.0)
    found.put('mechanism.load_inertia', joint.inertia, joint.sources.get('inertia', ''),
              read=True)
    found.put('mechanism.ratio', ratio, ratio_said)
    drive = drive_of(joint, given, ratio, found)
    controller = _controller(joint, ratio, found, lacking)
    lacking += _unsaid(joint, ratio, given)
    _passive(joint, found)
    if not joint.controlled:
        _on_command(joint, ratio, found, lacking)
    sensors = _sensors(given, found)
    try:
        servo = Servo(
            name, drive, Rigid, controller, sensors, tuple(found.effects), found.values,
            tolerance=_tolerance(given, found), step=_step(joint), linear=joint.slides,
            provenance={path: Provenance(said) for path, said in found.sources.items() if said})
    except ServoError as problem:
        raise ModelError(f'joint {joint.name!r} cannot be a servo: {problem}') from None
    return servo, lacking


def text_of(servo: Servo, about: list[str], lacking: list[str]) -> str:
    """Return a servo file, with comments before it: what it is, and what it lacks."""
    lines = list(about)
    if lacking:
        lines += ['', 'What the model has and this file lacks:', *(f'- {one}' for one in lacking)]
    if not servo.sensors:
        lines += ['', NO_SENSORS]
    return ''.join(f'# {line}'.rstrip() + '\n' for line in lines) + '\n' + dumps(servo)


def _armature_said(joint: Joint, ratio: float) -> str:
    said = joint.sources.get('armature', 'the model holds no armature')
    scaled = ratio != 1.0 and joint.armature
    return said + (f', over the ratio squared ({ratio:g})' if scaled else '')


def _unsaid(joint: Joint, ratio: float, given: Given) -> list[str]:
    """Return what a motor behind a gear has, and what a robot counts at the joint instead."""
    if ratio == 1.0 or joint.winding is not None:
        return []
    said = []
    if not joint.armature:
        said.append('the inertia of the rotor, 0 in the servo file: at this ratio it may be most '
                    'of all; the source of mechanism.rotor_inertia says who holds it')
    by_torque = not (joint.gain or joint.back_emf or given.torque_constant or joint.controlled)
    told = f', and voltage is its torque over {ratio:g}' if by_torque else ''
    return [*said, 'the scale of what a robot counts at the joint: its angle is load_position'
            + told]


def _controller(joint: Joint, ratio: float, found: FoundValues, lacking: list[str]) -> type:
    if not joint.controlled:
        return Open
    values, sources = found.values, joint.sources
    for name in ('kp', 'kd', 'kf'):
        found.put(f'controller.{name}', getattr(joint, name), sources.get(name, ''))
    found.put('controller.command_torque',
              ratio * values['drive.gain'] * values['drive.torque_constant'],
              'by definition: that of the drive, since the simulator has one torque only')
    if joint.torque_limit < inf:
        found.put('controller.torque_limit', joint.torque_limit, sources.get('torque_limit', ''))
    if joint.gain < 0.0:
        lacking.append('the sign of what is fed forward: turn it round')
    for name, what in (('command_limit', 'the limit of what is fed forward'),
                       ('lag', 'the filter of what is fed forward, s'),
                       ('delay', 'the delay of what is fed forward, s')):
        if getattr(joint, name) not in (0.0, inf):
            lacking.append(f'{what}: {getattr(joint, name):g}')
    return Impedance


def _passive(joint: Joint, found: FoundValues) -> None:
    sources = joint.sources
    if joint.friction:
        found.place('friction', 'coulomb_friction', 'load', sources.get('friction', ''),
                    level=joint.friction)
    if joint.damping:
        found.place('damping', 'viscous_friction', 'load', sources.get('damping', ''),
                    slope=joint.damping)
    if joint.stiffness:
        found.place('spring', 'spring_load', 'load', sources.get('stiffness', ''),
                    stiffness=joint.stiffness, rest=joint.rest)
    if joint.cosine or joint.sine:
        found.place('gravity', 'gravity', 'load', sources.get('cosine', ''),
                    cosine=joint.cosine, sine=joint.sine)
        if joint.slides:
            found.put('effects.gravity.order', _CONSTANT,
                      'by definition: the least order there is, for a force that is constant')


def _on_command(joint: Joint, ratio: float, found: FoundValues, lacking: list[str]) -> None:
    """Take limits, lag and delay of a command that goes straight to the drive."""
    limit, source = joint.command_limit, joint.sources.get('command_limit', '')
    if joint.torque_limit < inf and (joint.winding is not None or joint.back_emf):
        lacking.append(f'its torque limit, {joint.torque_limit:g} {joint.unit("N m")} '
                       f'({joint.sources.get("torque_limit", "")})')
    elif joint.torque_limit < inf:
        values = found.values
        unit = ratio * abs(values['drive.gain']) * values['drive.torque_constant']
        if joint.torque_limit / unit < limit:
            limit = joint.torque_limit / unit
            source = (f'{joint.sources.get("torque_limit", "")}, over the torque of one command '
                      f'({unit:g} {joint.unit("N m")})')
    if limit < inf:
        found.place('limit', 'drive_saturation', 'command', source, limit=limit, share=1.0)
    if joint.lag:
        found.place('lag', 'current_lag', 'current', joint.sources.get('lag', ''), lag=joint.lag)
    if joint.delay:
        found.place('delay', 'command_delay', 'command', joint.sources.get('delay', ''),
                    delay=joint.delay)


def _sensors(given: Given, found: FoundValues) -> tuple:
    for channel in given.noise:
        if channel not in _SENSOR_OF:
            raise ModelError(f'--noise {channel}: there is no such channel; '
                             f'{or_what(channel, _SENSOR_OF)}')
    chosen = [sensor for channel, sensor in _SENSOR_OF.items() if channel in given.noise]
    for sensor in chosen:
        value = given.noise[sensor.channel]
        found.put(f'sensors.{sensor.name}.noise', value,
                  f'given: --noise {sensor.channel}={value:g}')
    return tuple(chosen)


def _tolerance(given: Given, found: FoundValues) -> dict[str, tuple[float, float]]:
    if given.tolerance is None:
        return {}
    if not given.tolerance > 0.0:
        raise ModelError(f'--tolerance {given.tolerance:g} is not positive')
    wide = {}
    for path in found.read:
        value = found.values[path]
        if isinstance(value, float) and value and not path.startswith('effects.limit.'):
            edge = abs(value) * given.tolerance
            wide[path] = (value - edge, value + edge)
    return wide


def _step(joint: Joint) -> float:
    """Return a step that is short against the fastest spring, s."""
    stiff = joint.stiffness + joint.kp
    fast = sqrt(stiff / (joint.inertia + joint.armature))
    return min(STEP, 0.1 / fast) if fast else STEP
