"""What a servo file needs and a simulator does not hold: given by somebody, or by definition."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf

from ..joint import Joint, ModelError


@dataclass(frozen=True)
class Given:
    """
    What a servo file needs and a simulator does not hold, as somebody gave it.

    ``ratio`` in turns of the motor for one of the joint, and ``ratio_source`` where it is from, if
    not from a flag; ``torque_constant`` in N m/A, ``resistance`` in ohm, ``armature`` in kg m2 at
    the joint; ``kp``, ``kd`` and ``torque_limit`` of a controller outside of the model (N m/rad,
    N m s/rad, N m at the joint). ``noise`` maps channels to the standard deviation of a reading,
    ``tolerance`` is a share such as 0.1. None is not given.
    """

    ratio: float | None = None
    ratio_source: str = ''
    torque_constant: float | None = None
    resistance: float | None = None
    armature: float | None = None
    kp: float | None = None
    kd: float | None = None
    torque_limit: float | None = None
    noise: Mapping[str, float] = field(default_factory=dict)
    tolerance: float | None = None


def with_given(joint: Joint, given: Given) -> Joint:
    """Return a joint with the gains and the armature that stand outside of its model."""
    _check(given)
    changes: dict[str, float] = {}
    sources = dict(joint.sources)
    outside = {'kp': given.kp, 'kd': given.kd}
    if any(value is not None for value in outside.values()):
        if joint.controlled:
            raise ModelError(f'joint {joint.name!r}: --kp and --kd are given, and the model holds '
                             f'kp = {joint.kp:g} and kd = {joint.kd:g} already')
        if joint.back_emf or joint.winding:
            raise ModelError(f'joint {joint.name!r}: --kp and --kd command a torque, and its '
                             f'actuator takes a voltage; choose another by --actuator')
        changes |= {name: value or 0.0 for name, value in outside.items()}
        changes['kf'] = 1.0
    if given.torque_limit is not None:
        changes['torque_limit'] = min(given.torque_limit, joint.torque_limit)
    if given.armature is not None:
        if joint.armature:
            raise ModelError(f'joint {joint.name!r}: --armature is given, and the model holds '
                             f'{joint.armature:g} already')
        changes['armature'] = given.armature
    for name, value in changes.items():
        if name != 'torque_limit' or value == given.torque_limit:
            sources[name] = f'given: --{name.replace("_", "-")} {value:g}'
    if 'kf' in changes:
        sources['kf'] = 'by definition: the damping is towards the reference speed'
        sources |= {name: 'by definition: not given beside the other gain'
                    for name, value in outside.items() if value is None}
    return replace(joint, **changes, sources=sources)


def _check(given: Given) -> None:
    """Raise ModelError for a number that no machine has."""
    for name in ('torque_constant', 'resistance', 'armature', 'kp', 'kd', 'torque_limit'):
        value = getattr(given, name)
        if value is not None and not 0.0 <= value < inf:
            raise ModelError(f'--{name.replace("_", "-")} {value:g}: it must be 0 or more, and '
                             'finite')


def ratio_of(joint: Joint, given: Given) -> tuple[float, str]:
    """
    Return the turns of the motor for one of the joint, and where they are from.

    Of a joint that slides it is in rad/m, or 1 of a linear motor.
    """
    if joint.winding is not None:
        gear = joint.winding.gear
        if given.ratio not in (None, gear):
            raise ModelError(f'--ratio {given.ratio:g}: the motor of joint {joint.name!r} has the '
                             f'gear {gear:g} in the model')
        return gear, 'gear of the actuator'
    if given.ratio is None:
        return 1.0, 'by definition: all at the joint'
    if not given.ratio > 0.0:
        raise ModelError(f'--ratio {given.ratio:g} is not positive')
    return given.ratio, given.ratio_source or f'given: --ratio {given.ratio:g}'
