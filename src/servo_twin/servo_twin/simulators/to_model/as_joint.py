"""A servo as the joint of a simulator: what goes over as it is, and what cannot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf

from ...physics.controllers import Cascade, Impedance, PositionLoop, VelocityPi
from ...physics.drives import CurrentAmplifier, CurrentDrive, VoltageDrive, winding
from ...physics.fixed_inertia import with_fixed_inertia
from ...physics.mechanisms.ball_screw import BallScrew
from ...physics.mechanisms.rigid import Rigid
from ...physics.mechanisms.two_inertia import TwoInertia
from ...physics.servo import Placed, Servo
from ..joint import Joint, ModelError

_CONSTANT = 0.011  # 1/m: gravity of a smaller order is a constant force on a slide


@dataclass(frozen=True)
class Lost:
    """
    Something of a servo that the joint of a simulator has no place for.

    ``what`` it is, ``nearest`` what stands for it there. ``effect`` names the servo's effect, if
    it is one; otherwise ``without`` is the servo that lacks it, None where there is none. What
    that one lacks besides is in ``beside``, names of effects.
    """

    what: str
    nearest: str
    effect: str = ''
    without: Servo | None = None
    beside: tuple[str, ...] = ()


@dataclass
class _Making:
    """A joint as it is found, and what was lost so far."""

    servo: Servo
    lever: float  # torque at the load for one at the motor
    joint: Joint
    lost: list[Lost]
    remarks: list[str]

    def add(self, **more: float) -> None:
        """Add to numbers of the joint."""
        self.joint = replace(self.joint, **{name: getattr(self.joint, name) + value
                                            for name, value in more.items()})

    def limit(self, **most: float) -> None:
        """Lower limits of the joint."""
        self.joint = replace(self.joint, **{name: min(getattr(self.joint, name), value)
                                            for name, value in most.items()})

    def lose(self, what: str, nearest: str, effect: str = '', **values: float) -> None:
        """Note what is lost; ``values`` are those of the servo without it."""
        changed = {path.replace('__', '.'): value for path, value in values.items()}
        self.lost.append(Lost(what, nearest, effect,
                              self.servo.with_values(changed) if changed else None))


def joint_of_servo(servo: Servo, name: str) -> tuple[Joint, list[Lost], list[str]]:
    """
    Return a servo as one rigid joint, what is lost in the order of the signal, and remarks.

    Friction that a simulator has no law for is lost here; see :mod:`.nearest_friction` for what
    stands for it. Raises ModelError for a servo whose drive or mechanism no joint can be.
    """
    servo = with_fixed_inertia(servo, 0.0)
    making = _Making(servo, 1.0, Joint(name, servo.linear or servo.mechanism.slides), [], [])
    _mechanism(making)
    _drive(making)
    _controller(making)
    for placed in servo.effects:
        values = {parameter: servo.values[f'effects.{placed.name}.{parameter}']
                  for parameter in placed.effect.parameters}
        taken = _EFFECTS.get(placed.effect.name)
        if taken is None or not taken(making, placed, values):
            _effect_lost(making, placed)
    return making.joint, making.lost, making.remarks


def _mechanism(making: _Making) -> None:
    servo, v = making.servo, making.servo.values
    if servo.mechanism not in (Rigid, TwoInertia, BallScrew):
        raise ModelError(f'{servo.name}: a mechanism {servo.mechanism.name} is no joint of a '
                         f'rigid-body simulator; rigid, two_inertia and ball_screw are')
    making.lever = v['mechanism.ratio'] * v.get('mechanism.efficiency', 1.0)
    turning = sum(v.get(f'mechanism.{part}_inertia', 0.0)
                  for part in ('rotor', 'coupling', 'screw'))
    reflected = making.lever * v['mechanism.ratio']
    making.add(inertia=v['mechanism.load_inertia'], armature=reflected * turning,
               damping=reflected * v.get('mechanism.screw_damping', 0.0))
    if servo.mechanism is TwoInertia:
        inside = tuple(placed.name for placed in servo.effects
                       if placed.effect.port in ('mesh', 'clearance'))
        bare = servo.without_effects(lambda placed: placed.name in inside)
        stiff = replace(bare, mechanism=Rigid, tolerance={}, provenance={}, values={
            path: value for path, value in bare.values.items()
            if path not in ('mechanism.stiffness', 'mechanism.damping')})
        making.lost.append(Lost(
            f'compliance of the transmission, {v["mechanism.stiffness"]:g} '
            f'{servo.unit("mechanism.stiffness")}', 'a rigid one', without=stiff, beside=inside))
    elif servo.mechanism is BallScrew:
        making.lose('compliance of screw and nut', 'a rigid screw')


def _drive(making: _Making) -> None:
    servo, v = making.servo, making.servo.values
    constant = v['drive.torque_constant']
    if servo.drive is CurrentDrive:
        making.add(gain=making.lever * constant * v['drive.gain'])
        return
    if servo.drive not in (VoltageDrive, CurrentAmplifier):
        raise ModelError(f'{servo.name}: a drive {servo.drive.name} has loops of its own, which '
                         f'no joint of a simulator has; put its torque at the joint in the '
                         f'servo file as a drive of type current')
    gain, ohms = winding(v)
    reflected = making.lever * v['mechanism.ratio']
    making.add(gain=making.lever * constant * gain / ohms,
               back_emf=reflected * constant * v['drive.back_emf'] / ohms)
    if v['drive.inductance'] > 0.0:
        making.lose(f'inductance of the winding, {v["drive.inductance"]:g} H',
                    'a current without lag', drive__inductance=0.0)
    if servo.drive is CurrentAmplifier:
        making.limit(command_limit=v['drive.current_limit'] / abs(v['drive.gain']))
        making.lose(f'supply of {v["drive.supply"]:g} V', 'one without end')


def _controller(making: _Making) -> None:
    servo, v, kind = making.servo, making.servo.values, making.servo.controller
    unit = making.joint.gain
    own = {path.removeprefix('controller.'): value for path, value in v.items()
           if path.startswith('controller.')}
    if kind is Impedance:
        scale = unit / own['command_torque']
        making.add(kp=scale * own['kp'], kd=scale * own['kd'])
        making.joint = replace(making.joint, kf=own['kf'])
        most = scale * own['torque_limit'] if own['torque_limit'] < 1e6 else inf
    elif kind is VelocityPi:
        # what integrates an error of speed is a spring towards the integral of its reference
        making.add(kp=unit * own['ki'], kd=unit * own['kp'])
        most = unit * own['limit']
        if own['ki']:
            making.remarks.append('the integral of the speed loop is a spring: its position '
                                  'reference is the integral of the reference speed, which goes '
                                  'on while the torque is at its limit')
    elif kind is PositionLoop:
        making.add(kp=unit * own['kv'] * own['kp'], kd=unit * own['kv'] * own['kd'])
        making.joint = replace(making.joint, kf=own['kf'] / own['kd'] if own['kd'] else 0.0)
        most = unit * own['limit']
        if own['kf'] and not own['kd']:
            making.lose('speed that is fed on without damping', 'none', controller__kf=0.0)
    elif kind is Cascade:
        making.add(kp=unit * own['kv'] * own['kp'], kd=unit * own['kv'])
        making.joint = replace(making.joint, kf=0.0)
        most = unit * own['limit']
        making.lose(f'limit of the speed asked for, {own["speed_limit"]:g} rad/s', 'none',
                    controller__speed_limit=1e6)
    elif servo.controller.parameters:
        raise ModelError(f'{servo.name}: there is no simulator with a controller '
                         f'{kind.name!r}; take it off the servo file to export the rest')
    else:
        return
    # what the back EMF takes is no part of what the controller's limit holds
    making.add(damping=making.joint.back_emf)
    making.joint = replace(making.joint, back_emf=0.0)
    making.limit(torque_limit=min(most, making.joint.command_limit * unit))
    making.joint = replace(making.joint, command_limit=inf)
    if own.get('ki', 0.0) > 0.0 and kind is not VelocityPi:
        unit = servo.unit('controller.ki')
        making.lose(f'integral action of the controller, {own["ki"]:g} {unit}', 'none',
                    controller__ki=0.0)
    if own.get('filter', 0.0) > 0.0:
        making.lose(f'filter of the speed, {own["filter"]:g} s', 'none', controller__filter=0.0)


def _dry(making: _Making, placed: Placed, values: Mapping[str, float]) -> bool:
    making.add(friction=values['level'] * (making.lever if placed.site == 'motor' else 1.0))
    return True


def _viscous(making: _Making, placed: Placed, values: Mapping[str, float]) -> bool:
    reflected = making.lever * making.servo.values['mechanism.ratio']
    making.add(damping=values['slope'] * (reflected if placed.site == 'motor' else 1.0))
    return True


def _gravity(making: _Making, placed: Placed, values: Mapping[str, float]) -> bool:
    if making.joint.slides:
        if values['order'] > _CONSTANT:
            return False
        making.add(cosine=values['cosine'])
        return True
    if values['order'] != 1.0:
        return False
    making.add(cosine=values['cosine'], sine=values['sine'])
    return True


def _spring(making: _Making, placed: Placed, values: Mapping[str, float]) -> bool:
    if making.joint.stiffness:
        return False
    making.joint = replace(making.joint, stiffness=values['stiffness'], rest=values['rest'])
    return True


def _saturation(making: _Making, placed: Placed, values: Mapping[str, float]) -> bool:
    if values['share'] != 1.0:
        return False
    if making.joint.controlled:
        making.limit(torque_limit=values['limit'] * making.joint.gain)
    else:
        making.limit(command_limit=values['limit'])
    return True


def _lag(making: _Making, placed: Placed, values: Mapping[str, float]) -> bool:
    if making.joint.controlled or making.joint.back_emf or making.joint.lag:
        return False
    making.add(lag=values['lag'])
    return True


def _delay(making: _Making, placed: Placed, values: Mapping[str, float]) -> bool:
    if making.joint.controlled or making.joint.delay:
        return False
    making.add(delay=values['delay'])
    return True


_EFFECTS: Mapping[str, Callable[[_Making, Placed, Mapping[str, float]], bool]] = {
    'coulomb_friction': _dry, 'viscous_friction': _viscous, 'gravity': _gravity,
    'spring_load': _spring, 'drive_saturation': _saturation, 'current_lag': _lag,
    'command_delay': _delay,
}
"""Effects that a simulator may hold; each says whether this one could be."""

_STANDS_FOR = {
    'friction': 'dry and viscous friction, by least squares',
    'torque': 'dry and viscous friction, by least squares',
    'clearance': 'none', 'mesh_error': 'an even transmission', 'mesh': 'a rigid transmission',
    'drive': 'a command that acts at once', 'sensor': 'readings without error',
}


def _effect_lost(making: _Making, placed: Placed) -> None:
    what = placed.effect.name.replace('_', ' ')
    making.lose(f'{what} at {placed.site.replace("_", " ")} ({placed.name})',
                _STANDS_FOR[placed.effect.port], placed.name)
