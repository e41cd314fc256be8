"""A joint of a MuJoCo model, read as MuJoCo answers it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import hypot, inf, pi
from typing import Any

import numpy as np

from ..joint import Joint, ModelError
from .mujoco_actuators import Actuator, actuators_at, dynamics_of, limits_of, name_of, others_moved
from .mujoco_couplings import ends_of, named
from .mujoco_probe import is_of, Probe
from .mujoco_winding import is_warm

_LEAST = 1e-9  # share of a torque below which it is rounding
_LEVER = 1e-9  # m, lever of all that a joint carries below which gravity has none


def hinges_and_slides(model: Any) -> list[str]:
    """Return the joints of a MuJoCo model that a servo may drive; raises ModelError for none."""
    import mujoco

    kinds = mujoco.mjtJoint
    found = [model.joint(one).name for one in range(model.njnt) if model.joint(one).name
             and is_of(model.jnt_type[one], kinds.mjJNT_HINGE, kinds.mjJNT_SLIDE)]
    if not found:
        raise ModelError('no joint of the model is a hinge or a slide with a name')
    return found


def joint_of(model: Any, name: str, origin: str, keyframe: str | None = None,
             at: Mapping[str, float] | None = None, actuators: Sequence[str] = ()) -> Joint:
    """
    Return a joint as a MuJoCo model holds it, each value with where it comes from.

    ``origin`` names the model, ``keyframe`` and ``at`` the pose at which the rest is held (see
    :class:`.mujoco_probe.Probe`), ``actuators`` those to take where several act on the joint.
    Raises ModelError.
    """
    probe = Probe(model, name, keyframe, at)
    said = f'{origin}: joint {name!r}'
    left_out: list[str] = []
    fields: dict[str, float] = {}
    sources: dict[str, str] = {}

    def take(field: str, value: float, source: str) -> None:
        fields[field], sources[field] = value, source

    where = _pose(keyframe, at or {})
    carried = f'{origin}: masses that joint {name!r} carries, the rest held at {where}'
    take('inertia', probe.inertia(), carried)
    _armature(probe, said, take, left_out)
    _friction(probe, said, take, left_out)
    _spring(probe, said, take, left_out)
    _gravity(probe, carried, take, left_out)
    ends_of(probe, left_out)
    drive = _drive(probe, actuators_at(probe, actuators), said, take, left_out)
    return replace(Joint(name, bool(probe.slides), winding=drive, sources=sources), **fields,
                   left_out=tuple(left_out))


def _pose(keyframe: str | None, at: Mapping[str, float]) -> str:
    said = 'qpos0' if keyframe is None else f'keyframe {keyframe!r}'
    return said + ''.join(f', {name} = {value:g}' for name, value in at.items())


def _armature(probe: Probe, said: str, take: Any, left_out: list[str]) -> None:
    model, dof = probe.model, probe.dof
    value = float(model.dof_armature[dof])
    parts = ['armature'] if value else []
    for i in range(probe.actuators if hasattr(model, 'actuator_armature') else 0):
        own = float(model.actuator_armature[i])
        if own and int(model.actuator_trnid[i][0]) == probe.id and _on_joint(probe, i):
            value += own * float(model.actuator_gear[i][0]) ** 2
            parts.append(f'armature of actuator {name_of(probe, i)!r} times its gear squared')
    take('armature', value, f'{said}, {" and ".join(parts) or "no armature"}')
    beside = probe.whole_inertia() - probe.inertia() - value
    if abs(beside) > 1e-6 * probe.whole_inertia():
        left_out.append(f'armature of tendons, {beside:g} {_unit(probe, "kg m2")} at the joint')


def _on_joint(probe: Probe, actuator: int) -> bool:
    kinds = probe.mujoco.mjtTrn
    return is_of(probe.model.actuator_trntype[actuator], kinds.mjTRN_JOINT,
                 kinds.mjTRN_JOINTINPARENT)


def _friction(probe: Probe, said: str, take: Any, left_out: list[str]) -> None:
    """Read damping (a v + b v |v| + c v^3, by three speeds) and the dry friction."""
    speeds = np.array([1.0, 2.0, 3.0])
    lost = [-probe.at(probe.forces(speed=v).qfrc_damper) for v in speeds]
    damping, square, cubic = (float(v) for v in np.linalg.solve(
        np.column_stack([speeds, speeds**2, speeds**3]), lost))
    for power, value in (('square', square), ('cube', cubic)):
        if abs(value) > _LEAST * max(map(abs, lost)):
            left_out.append(f'damping that grows with the {power} of the speed, {value:g} '
                            f'{_unit(probe, "N m")} at 1 {_unit(probe, "rad")}/s')
    if abs(square) + abs(cubic) <= _LEAST * abs(lost[0]):
        damping = lost[0]
    if damping > 0.0:
        take('damping', damping, f'{said}, damping')
    friction, parts = float(probe.model.dof_frictionloss[probe.dof]), ['frictionloss']
    for tendon, way in probe.tendons().items():
        if probe.model.tendon_frictionloss[tendon] > 0.0:
            friction += abs(way) * float(probe.model.tendon_frictionloss[tendon])
            parts.append(f'that of tendon {named(probe, "TENDON", tendon)!r}')
    if friction > 0.0 and not probe.disabled('mjDSBL_FRICTIONLOSS'):
        take('friction', friction, f'{said}, {" and ".join(parts)}')
        soft = probe.model.dof_solref[probe.dof]
        if soft[0] > 5.0 * probe.model.opt.timestep:
            left_out.append(f'softness of the dry friction (solreffriction {soft[0]:g} s): in '
                            f'MuJoCo the joint creeps where the twin sticks')
    fluid = probe.at(probe.forces(speed=1.0).qfrc_fluid) if hasattr(
        probe.forces(), 'qfrc_fluid') else 0.0
    if fluid:
        left_out.append(f'drag of the medium, {abs(fluid):g} {_unit(probe, "N m")} at 1 '
                        f'{_unit(probe, "rad")}/s')


def _spring(probe: Probe, said: str, take: Any, left_out: list[str]) -> None:
    at = {q: probe.at(probe.forces(q).qfrc_spring) for q in (-1.0, 0.0, 1.0)}
    stiffness = 0.5 * (at[-1.0] - at[1.0])
    bent = at[1.0] + at[-1.0] - 2.0 * at[0.0]
    if stiffness > 0.0:
        take('stiffness', stiffness, f'{said}, stiffness')
        take('rest', at[0.0] / stiffness, f'{said}, springref')
    size = max(abs(value) for value in at.values())
    straight = abs(bent) <= _LEAST * size and abs(
        probe.at(probe.forces(2.0).qfrc_spring) - (at[0.0] - 2.0 * stiffness)) <= 1e-6 * size
    if not straight:
        left_out.append('the bend of its spring: a servo file has a linear one, here that between '
                        f'-1 and 1 {_unit(probe, "rad")}')


def _gravity(probe: Probe, carried: str, take: Any, left_out: list[str]) -> None:
    def torque(q: float) -> float:
        data = probe.forces(q)
        return probe.at(data.qfrc_gravcomp) - probe.at(data.qfrc_bias)

    if probe.slides:
        cosine, sine = torque(0.0), 0.0
        shifted = torque(0.5) - cosine
    else:
        cosine = 0.5 * (torque(0.0) - torque(pi))
        sine = 0.5 * (torque(0.5 * pi) - torque(-0.5 * pi))
        shifted = torque(0.0) + torque(pi)
    size = max(hypot(cosine, sine), abs(shifted))
    scale = _LEVER * 9.81 * float(probe.model.body_subtreemass[
        probe.model.jnt_bodyid[probe.id]])
    if size > scale:
        for field, value in (('cosine', cosine), ('sine', sine)):
            take(field, value if abs(value) > _LEAST * size else 0.0, f'{carried}; gravity')
    if abs(shifted) > max(1e-6 * size, scale):
        left_out.append(f'a part of the gravity torque that does not go with the sine of the '
                        f'angle, {shifted:g} {_unit(probe, "N m")}')


def _drive(probe: Probe, found: list[Actuator], said: str, take: Any, left_out: list[str]):
    """Read what drives the joint; return the motor, where MuJoCo has one."""
    model = probe.model
    kinds = [one.kind for one in found]
    for kind in set(kinds):
        if kinds.count(kind) > 1:
            names = [one.name for one in found if one.kind == kind]
            raise ModelError(f'{said}: several actuators of the kind {kind} act on it: {names}; '
                             f'choose by --actuator')
    if len(found) > 1 and not set(kinds) <= {'torque', 'position', 'velocity'}:
        raise ModelError(f'{said}: { {one.name: one.kind for one in found} } act on it '
                         f'together; choose by --actuator')
    limit, source = inf, ''
    if model.jnt_actfrclimited[probe.id]:
        span = model.jnt_actfrcrange[probe.id]
        if span[0] != -span[1]:
            left_out.append(f'actuatorfrcrange [{span[0]:g}, {span[1]:g}]: a servo has the same '
                            f'limit to both sides, here the larger')
        limit, source = max(abs(float(v)) for v in span), f'{said}, actuatorfrcrange'
    for one in found:
        own, control, remarks = limits_of(probe, one)
        lag, delay, more = dynamics_of(probe, one)
        left_out += remarks + more
        by = f'{said}, actuator {one.name!r}'
        if own < limit and len(found) > 1:
            left_out.append(f'forcerange of {one.name!r}, {own:g} {_unit(probe, "N m")}, which '
                            f'limits this actuator alone')
        elif own < limit:
            limit, source = own, f'{by}, forcerange'
        if others_moved(probe, one.place):
            left_out.append(f'what actuator {one.name!r} does at other joints')
        _take_one(probe, one, by, take, left_out)
        if control < inf:
            take('command_limit', control, f'{by}, ctrlrange')
        if lag:
            take('lag', lag, f'{by}, time constant of its filter')
        if delay:
            take('delay', delay, f'{by}, delay')
    both = [one for one in found if one.kind in ('position', 'velocity')]
    if both:
        kd = sum(one.damping for one in both)
        fed = sum(one.damping for one in both if 'velocity' in one.gains)
        names = ' and '.join(repr(one.name) for one in both)
        by = f'actuator{"s" if len(both) > 1 else ""} {names}'
        take('kp', sum(one.stiffness for one in both), f'{said}, {by}')
        take('kd', kd, f'{said}, {by}')
        take('kf', fed / kd if kd else 0.0,
             f'{said}, {by}: the share of kd with a reference speed')
    if limit < inf:
        take('torque_limit', limit, source)
    return next((one.winding for one in found if one.winding is not None), None)


def _take_one(probe: Probe, one: Actuator, by: str, take: Any, left_out: list[str]) -> None:
    """Read one actuator, besides its limits and what it shares with others."""
    if 'command' in one.gains and one.kind != 'winding':
        take('gain', one.gains['command'], f'{by}: torque for one of its control')
    if one.kind == 'motor':
        take('back_emf', one.damping, f'{by}: torque that a held control loses with speed')
    if one.kind == 'winding' and is_warm(probe, one.place):
        left_out.append(f'the temperature of the winding of {one.name!r}')
    for role, slope in (('position', one.stiffness), ('velocity', one.damping)):
        if role not in one.gains or not slope:
            continue
        scale = one.gains[role] / slope
        shift = one.offset / slope if role == one.kind else 0.0
        if abs(scale - 1.0) > _LEAST or abs(shift) > _LEAST:
            left_out.append(f'the scale of its reference: reference_{role} is {scale:g} times '
                            f'the control of {one.name!r}' + (f' plus {shift:g}' if shift else ''))
    if one.kind not in ('position', 'velocity') and abs(one.offset) > _LEAST:
        raise ModelError(f'{by}: pushes with {one.offset:g} {_unit(probe, "N m")} at rest without '
                         f'control (biasprm): a servo file has no such drive')


def _unit(probe: Probe, rotary: str) -> str:
    return Joint('', bool(probe.slides)).unit(rotary)
