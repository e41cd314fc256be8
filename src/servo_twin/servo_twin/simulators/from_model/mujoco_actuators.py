"""What the actuators of a MuJoCo model do at one joint, found by asking MuJoCo."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from ..joint import ModelError, Winding
from .mujoco_probe import is_of, Probe
from .mujoco_winding import winding_of

_POINTS = ((0.7, -2.0, 1.5), (-0.4, 3.0, -2.5))  # position, speed, control: is it affine?


@dataclass(frozen=True)
class Actuator:
    r"""
    One actuator at the joint: :math:`\tau = \sum_i g_i u_i + b - k q - d \dot q`.

    ``gains`` maps what an input stands for (`command`, `position`, `velocity`) to its slope, in
    N m for one of the input; ``kind`` is `torque`, `position`, `velocity`, `motor` or `winding`.
    """

    place: int
    name: str
    kind: str
    gains: dict[str, float]
    stiffness: float
    damping: float
    offset: float
    winding: Winding | None = None


def actuators_at(probe: Probe, chosen: Sequence[str] = ()) -> list[Actuator]:
    """
    Return the actuators that act on the joint, or those that are chosen by name.

    Raises ModelError where a chosen one does not act on the joint, and where one is no affine
    function of control, position and speed.
    """
    acting = {name_of(probe, i): i for i in range(probe.actuators)
              if probe.enabled(i) and _acts(probe, i)}
    for name in chosen:
        if name not in acting:
            raise ModelError(f'actuator {name!r} does not act on joint {probe.name!r}; there are '
                             f'{list(acting)}')
    found = []
    for name, i in acting.items():
        if chosen and name not in chosen:
            continue
        try:
            found.append(_measured(probe, i, name))
        except ModelError as problem:
            others = [other for other in acting if other != name]
            instead = f'choose others by --actuator ({others}), or take' if others else 'take'
            raise ModelError(
                f'{problem}. A servo file has tau = gain * control - kp q - kd dq. To have the '
                f'joint without it, {instead} it out of the model; "voltage" is the torque of '
                f'the joint then') from None
    return found


def name_of(probe: Probe, place: int) -> str:
    """Return the name of an actuator, or its number."""
    kind = probe.mujoco.mjtObj.mjOBJ_ACTUATOR
    return probe.mujoco.mj_id2name(probe.model, kind, place) or f'number {place}'


def limits_of(probe: Probe, one: Actuator) -> tuple[float, float, list[str]]:
    """Return the limits of an actuator's torque (N m) and of its first control, and remarks."""
    model, i = probe.model, one.place
    first, said = probe.control_of(i)[0], []
    unclamped = probe.disabled('mjDSBL_CLAMPCTRL')
    torque = control = inf
    if model.actuator_forcelimited[i]:
        torque = abs(probe.arm(i)) * _side(model.actuator_forcerange[i],
                                           f'forcerange of {one.name!r}', said)
    if model.actuator_actlimited[i]:
        row = model.actuator_actrange[i]
        said.append(f'actrange [{row[0]:g}, {row[1]:g}] of {one.name!r}: the limit of its state')
    for k, role in enumerate(one.gains):
        if unclamped or not model.actuator_ctrllimited[first + k]:
            continue
        row = model.actuator_ctrlrange[first + k]
        if role == 'command':
            control = _side(row, f'ctrlrange of {one.name!r}', said)
        else:
            said.append(f'ctrlrange [{row[0]:g}, {row[1]:g}] of {one.name!r}: the reference of a '
                        f'recording is taken as it is')
    return torque, control, said


def dynamics_of(probe: Probe, one: Actuator) -> tuple[float, float, list[str]]:
    """Return lag and delay of an actuator's command, s, and what else it has, a sentence each."""
    model, i, kinds = probe.model, one.place, probe.mujoco.mjtDyn
    said: list[str] = []
    lag = delay = 0.0
    kind = model.actuator_dyntype[i]
    if is_of(kind, kinds.mjDYN_FILTER, kinds.mjDYN_FILTEREXACT):
        lag = float(model.actuator_dynprm[i][0])
    elif is_of(kind, kinds.mjDYN_INTEGRATOR):
        said.append(f'the integrator of {one.name!r}: bring the integral of its control as '
                    f'reference_position')
    elif is_of(kind, getattr(kinds, 'mjDYN_PID', -1)):
        said.append(f'integral action or slew rate of {one.name!r} (pid)')
    if model.actuator_plugin[i] >= 0 and model.actuator_actnum[i]:
        said.append(f'the states of the plugin of {one.name!r}: an integral or a slew rate')
    delay = float(getattr(model, 'actuator_delay', np.zeros(probe.actuators))[i])
    if one.kind not in ('torque', 'motor', 'winding'):
        if lag:
            said.append(f'the filter of {one.name!r}, {lag:g} s on its reference')
        if delay:
            said.append(f'the delay of {one.name!r}, {delay:g} s on its reference')
        lag = delay = 0.0
    return lag, delay, said


def _measured(probe: Probe, place: int, name: str) -> Actuator:
    """Find the slopes of an actuator's torque."""
    winding = winding_of(probe, place, name)
    if winding is not None:
        return Actuator(place, name, 'winding', {'command': 1.0}, 0.0, 0.0, 0.0, winding)

    def torque(position: float, speed: float, controls: dict[int, float]) -> float:
        return probe.at(probe.torque(place, position, speed, controls))

    inputs = list(_inputs(probe, place))
    offset = torque(0.0, 0.0, {})
    stiffness = offset - torque(1.0, 0.0, {})
    damping = offset - torque(0.0, 1.0, {})
    slopes = [torque(0.0, 0.0, {k: 1.0}) - offset for k in range(len(inputs))]
    for q, speed, control in _POINTS:
        said = offset - stiffness * q - damping * speed + control * sum(slopes)
        truth = torque(q, speed, dict.fromkeys(range(len(inputs)), control))
        size = 1e-9 + abs(offset) + abs(stiffness) + abs(damping) + sum(map(abs, slopes))
        if not abs(said - truth) < 1e-6 * size:
            raise ModelError(f'the torque of actuator {name!r} is no affine function of control, '
                             f'position and speed ({_types(probe, place)})')
    if inputs and not any(slopes):
        raise ModelError(f'actuator {name!r} does not answer to its control '
                         f'({_types(probe, place)}, gain 0): it is a spring or a damper alone')
    if stiffness < -1e-12 * size or damping < -1e-12 * size:
        raise ModelError(f'actuator {name!r} pushes with position or speed (stiffness '
                         f'{stiffness:g}, damping {damping:g})')
    kind = _kind(probe, place, stiffness > 0.0, damping > 0.0)
    if inputs == ['command'] and kind in ('position', 'velocity'):
        inputs = [kind]
    return Actuator(place, name, kind, dict(zip(inputs, slopes, strict=True)), stiffness, damping,
                    offset)


def _kind(probe: Probe, place: int, stiff: bool, damped: bool) -> str:
    if stiff:
        return 'position'
    if not damped:
        return 'torque'
    gain, bias = probe.model.actuator_gainprm[place][0], probe.model.actuator_biasprm[place][2]
    if _is_pid(probe, place) or gain == -bias:
        return 'velocity'
    return 'motor'


def _inputs(probe: Probe, place: int) -> Iterator[str]:
    """Yield what the controls of an actuator stand for, in their order."""
    if not _is_pid(probe, place):
        yield from ['command'] * probe.control_of(place)[1]
        return
    bits, inputs = int(probe.model.actuator_ctrlspec[place]), probe.mujoco.mjtCtrlInput
    for bit, role in ((inputs.mjINPUT_POS, 'position'), (inputs.mjINPUT_VEL, 'velocity'),
                      (inputs.mjINPUT_FF, 'command')):
        if bits & int(bit):
            yield role


def _is_pid(probe: Probe, place: int) -> bool:
    return is_of(probe.model.actuator_gaintype[place],
                 getattr(probe.mujoco.mjtGain, 'mjGAIN_PID', -1))


def _acts(probe: Probe, place: int) -> bool:
    """Whether an actuator moves the joint: directly, or through a tendon or a site."""
    model, kinds = probe.model, probe.mujoco.mjtTrn
    if is_of(model.actuator_trntype[place], kinds.mjTRN_JOINT, kinds.mjTRN_JOINTINPARENT):
        return int(model.actuator_trnid[place][0]) == probe.id
    if is_of(model.actuator_trntype[place], kinds.mjTRN_BODY):
        return False
    controls = dict.fromkeys(range(probe.control_of(place)[1]), 1.0)
    return probe.at(probe.torque(place, 0.0, 0.0, controls)) != 0.0


def others_moved(probe: Probe, place: int) -> bool:
    """Whether an actuator moves other joints too."""
    controls = dict.fromkeys(range(probe.control_of(place)[1]), 1.0)
    return bool(np.delete(probe.torque(place, 0.0, 0.0, controls), probe.dof).any())


def _types(probe: Probe, place: int) -> str:
    model, library = probe.model, probe.mujoco
    names = (library.mjtGain(int(model.actuator_gaintype[place])).name.removeprefix('mjGAIN_'),
             library.mjtBias(int(model.actuator_biastype[place])).name.removeprefix('mjBIAS_'))
    return f'gaintype {names[0].lower()}, biastype {names[1].lower()}'


def _side(span: Any, what: str, said: list[str]) -> float:
    """Return the larger side of a range; a servo's limits are the same to both sides."""
    low, high = float(span[0]), float(span[1])
    if low != -high:
        said.append(f'{what} [{low:g}, {high:g}]: a servo has the same limit to both sides, here '
                    f'{max(abs(low), abs(high)):g}')
    return max(abs(low), abs(high))
