"""What holds a joint of a MuJoCo model, or couples it to others, beside its forces."""

from __future__ import annotations

from ..joint import Joint
from .mujoco_probe import is_of, Probe


def ends_of(probe: Probe, left_out: list[str]) -> None:
    """Say what holds or couples the joint beside its forces."""
    model, mujoco, tendons = probe.model, probe.mujoco, probe.tendons()
    for tendon in tendons:
        name = named(probe, 'TENDON', tendon)
        if model.tendon_limited[tendon]:
            low, high = model.tendon_range[tendon]
            left_out.append(f'the range of tendon {name!r}, {low:g} to {high:g} m')
        if model.tendon_actfrclimited[tendon]:
            low, high = model.tendon_actfrcrange[tendon]
            left_out.append(f'actuatorfrcrange [{low:g}, {high:g}] of tendon {name!r}')
    if model.jnt_limited[probe.id]:
        low, high = model.jnt_range[probe.id]
        unit = Joint('', bool(probe.slides)).unit('rad')
        left_out.append(f'end stops at {low:.6g} and {high:.6g} {unit}')
    for i in range(probe.actuators):
        if is_of(model.actuator_trntype[i], mujoco.mjtTrn.mjTRN_BODY) and _carries(
                probe, int(model.actuator_trnid[i][0])):
            body = named(probe, 'BODY', int(model.actuator_trnid[i][0]))
            left_out.append(f'actuator {named(probe, "ACTUATOR", i) or i!r}: the adhesion of body '
                            f'{body!r} to what it touches, no torque of the joint')
    for i in range(model.neq if not probe.disabled('mjDSBL_EQUALITY') else 0):
        kind = mujoco.mjtEq(int(model.eq_type[i]))
        ends = int(model.eq_obj1id[i]), int(model.eq_obj2id[i])
        if not model.eq_active0[i]:
            continue
        if kind == mujoco.mjtEq.mjEQ_JOINT and probe.id in ends:
            name = named(probe, 'JOINT', sum(ends) - probe.id)
            left_out.append(f'the equality that couples it to joint {name!r}, and what that '
                            f'carries')
        elif kind == mujoco.mjtEq.mjEQ_TENDON and set(ends) & tendons.keys():
            left_out.append(f'the equality of tendon {named(probe, "TENDON", ends[0])!r}, which '
                            'couples it to others')
        elif kind in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD) and _moves(
                probe, i, ends):
            words = kind.name.removeprefix('mjEQ_').lower()
            left_out.append(f'the equality ({words}) number {i}, which closes a loop: what it '
                            'holds or carries beside this joint')


def _moves(probe: Probe, equality: int, ends: tuple[int, int]) -> bool:
    """Tell whether the joint carries one end of an equality of bodies or sites, and not both."""
    model, of = probe.model, probe.mujoco.mjtObj
    bodies = [int(model.site_bodyid[end]) if is_of(model.eq_objtype[equality], of.mjOBJ_SITE)
              else end for end in ends]
    return len({_carries(probe, body) for body in bodies}) == 2


def _carries(probe: Probe, body: int) -> bool:
    while body and body != int(probe.model.jnt_bodyid[probe.id]):
        body = int(probe.model.body_parentid[body])
    return body != 0


def named(probe: Probe, kind: str, place: int) -> str:
    """Return the name of a part of the model, '' where it has none."""
    return probe.mujoco.mj_id2name(probe.model, getattr(probe.mujoco.mjtObj, f'mjOBJ_{kind}'),
                                   place) or '' if place >= 0 else ''
