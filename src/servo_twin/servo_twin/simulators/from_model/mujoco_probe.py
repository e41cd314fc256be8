"""What MuJoCo answers at one joint, the rest of the model held at a pose."""

from __future__ import annotations

from collections.abc import Mapping
import copy
from typing import Any

import numpy as np

from ...description.nearest_name import or_what
from ..joint import ModelError
from ..mujoco_model import mujoco_library

_SMALL = 1e-4  # rad or m, over which a tendon is taken for straight
_OFF = 30  # group of the actuators that shall not act while another is asked


def is_of(value: Any, *kinds: Any) -> bool:
    """Whether a number of a model is one of MuJoCo's enumerated kinds."""
    return int(value) in [int(kind) for kind in kinds]


class Probe:
    """
    One hinge or slide of a MuJoCo model, asked by MuJoCo's own forward dynamics.

    ``keyframe`` names a pose of the model, ``at`` maps joints to positions (rad, m) that differ
    from it; left out, the pose is the one in which the model is drawn (qpos0). The joint itself is
    moved, all others stand still. Raises ModelError for a joint, a keyframe or a kind of joint
    that there is not.
    """

    def __init__(self, model: Any, joint: str, keyframe: str | None = None,
                 at: Mapping[str, float] | None = None) -> None:
        self.mujoco = mujoco_library()
        self.model = model
        self.name = joint
        self.id = self._find(joint)
        self.slides = is_of(model.jnt_type[self.id], self.mujoco.mjtJoint.mjJNT_SLIDE)
        self.dof = int(model.jnt_dofadr[self.id])
        self.address = int(model.jnt_qposadr[self.id])
        self.pose = self._posed(keyframe, at or {})
        self.actuators = getattr(model, 'nactuator', model.nu)
        self._free = self._unlimited()
        self._data = self.mujoco.MjData(self._free)
        self._groups = np.array(self._free.actuator_group)
        self._gears = np.array(self._free.actuator_gear)

    def inertia(self) -> float:
        """Return the inertia of what the joint carries about its axis, without armatures."""
        bare = copy.deepcopy(self.model)
        for name in ('dof_armature', 'actuator_armature', 'tendon_armature'):
            if hasattr(bare, name):
                getattr(bare, name)[:] = 0.0
        self.mujoco.mj_setConst(bare, self.mujoco.MjData(bare))
        return self._row_of_inertia(bare)

    def whole_inertia(self) -> float:
        """Return the same with all armatures."""
        return self._row_of_inertia(self.model)

    def forces(self, position: float = 0.0, speed: float = 0.0) -> Any:
        """Return MuJoCo's data at a position (rad, m) and a speed, without any actuator."""
        return self._forward(position, speed, None, {})

    def torque(self, actuator: int, position: float = 0.0, speed: float = 0.0,
               controls: Mapping[int, float] | None = None) -> np.ndarray:
        """
        Return the generalised forces of one actuator alone, without its limits and delay.

        ``controls`` maps its inputs (0, 1 ...) to values, the others are zero. Activations of
        filters and integrators stand where these controls would bring them.
        """
        alone = np.array(self._forward(position, speed, actuator, controls or {}).qfrc_actuator)
        return alone - self._forward(position, speed, None, {}).qfrc_actuator

    def arm(self, actuator: int) -> float:
        """Return what the joint gets of one unit of an actuator's force: gear, tendon and site."""
        controls = dict.fromkeys(range(self.control_of(actuator)[1]), 1.0)
        for position in (0.0, 1.0):
            force = self._forward(position, 0.0, actuator, controls).actuator_force[actuator]
            if force:
                return self.at(self.torque(actuator, position, 0.0, controls)) / float(force)
        return float(self._gears[actuator][0])

    def tendons(self) -> dict[int, float]:
        """Return the tendons that move with the joint, and their way for one of the joint's."""
        lengths = [np.array(self._forward(q, 0.0, None, {}).ten_length) for q in (-_SMALL, _SMALL)]
        way = (lengths[1] - lengths[0]) / (2.0 * _SMALL)
        return {i: float(way[i]) for i in range(self.model.ntendon) if abs(way[i]) > 1e-9}

    def _forward(self, position: float, speed: float, only: int | None,
                 controls: Mapping[int, float]) -> Any:
        free, data = self._free, self._data
        free.actuator_group[:] = _OFF
        free.opt.disableactuator |= 1 << _OFF
        free.actuator_gear[:] = 0.0  # its group does not switch a plugin off
        self.mujoco.mj_resetData(free, data)
        data.qpos[:] = self.pose
        data.qpos[self.address] = position
        data.qvel[self.dof] = speed
        if only is not None:
            free.actuator_group[only] = self._groups[only]
            free.actuator_gear[only] = self._gears[only]
            first = self.control_of(only)[0]
            for place, value in controls.items():
                data.ctrl[first + place] = value
            self._settle(only, data)
        self.mujoco.mj_forward(free, data)
        return data

    def at(self, vector: np.ndarray) -> float:
        """Return the entry of a vector of generalised forces that is this joint's."""
        return float(vector[self.dof])

    def enabled(self, actuator: int) -> bool:
        """Whether the model lets an actuator act."""
        off = self.model.opt.disableactuator & (1 << int(self._groups[actuator]))
        return not off and not self.disabled('mjDSBL_ACTUATION')

    def disabled(self, flag: str) -> bool:
        """Whether the model has a part of the physics switched off (option flag)."""
        return bool(self.model.opt.disableflags & int(getattr(self.mujoco.mjtDisableBit, flag)))

    def control_of(self, actuator: int) -> tuple[int, int]:
        """Return where the controls of an actuator begin in `ctrl`, and how many there are."""
        if hasattr(self.model, 'actuator_ctrladr'):
            return (int(self.model.actuator_ctrladr[actuator]),
                    int(self.model.actuator_ctrlnum[actuator]))
        return actuator, 1

    def _find(self, joint: str) -> int:
        model, kinds = self.model, self.mujoco.mjtJoint
        good = [self.mujoco.mj_id2name(model, self.mujoco.mjtObj.mjOBJ_JOINT, i)
                for i in range(model.njnt)
                if is_of(model.jnt_type[i], kinds.mjJNT_HINGE, kinds.mjJNT_SLIDE)]
        found = self.mujoco.mj_name2id(model, self.mujoco.mjtObj.mjOBJ_JOINT, joint)
        named = [name for name in good if name]
        if found < 0:
            unnamed = len(good) - len(named)
            more = f' and {unnamed} without a name' if unnamed else ''
            raise ModelError(f'there is no joint {joint!r}; '
                             f'{or_what(joint, named, "hinges and slides are")}{more}')
        if joint not in named:
            raise ModelError(f'joint {joint!r} is a ball or free joint; a servo turns a hinge or '
                             f'moves a slide: {named}')
        return found

    def _posed(self, keyframe: str | None, at: Mapping[str, float]) -> np.ndarray:
        model, mujoco = self.model, self.mujoco
        pose = np.array(model.qpos0)
        if keyframe is not None:
            place = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, keyframe)
            if place < 0:
                known = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_KEY, i)
                         for i in range(model.nkey)]
                raise ModelError(f'there is no keyframe {keyframe!r}; {or_what(keyframe, known)}')
            pose = np.array(model.key_qpos[place])
        for name, value in at.items():
            place = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
            if place < 0:
                known = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, i) or ''
                         for i in range(model.njnt)]
                raise ModelError(f'--at {name}={value:g}: there is no joint {name!r}; '
                                 f'{or_what(name, filter(None, known))}')
            if not is_of(model.jnt_type[place], mujoco.mjtJoint.mjJNT_HINGE,
                         mujoco.mjtJoint.mjJNT_SLIDE):
                raise ModelError(f'--at {name}={value:g}: only hinges and slides can be set; '
                                 f'name a keyframe for the pose of a ball or free joint')
            pose[model.jnt_qposadr[place]] = value
        return pose

    def _unlimited(self) -> Any:
        """Return the model without limits and delays of its actuators."""
        free = copy.deepcopy(self.model)
        for name in ('actuator_ctrllimited', 'actuator_forcelimited', 'actuator_actlimited',
                     'jnt_actfrclimited', 'tendon_actfrclimited', 'actuator_delay'):
            if hasattr(free, name):
                getattr(free, name)[:] = 0
        return free

    def _settle(self, actuator: int, data: Any) -> None:
        """Put the activation of a filter or an integrator where its control would bring it."""
        dynamics = self.mujoco.mjtDyn
        if is_of(self._free.actuator_dyntype[actuator], dynamics.mjDYN_INTEGRATOR,
                 dynamics.mjDYN_FILTER, dynamics.mjDYN_FILTEREXACT):
            last = (self._free.actuator_actadr[actuator] + self._free.actuator_actnum[actuator]
                    - 1)
            data.act[last] = data.ctrl[self.control_of(actuator)[0]]

    def _row_of_inertia(self, model: Any) -> float:
        data = self.mujoco.MjData(model)
        data.qpos[:] = self.pose
        self.mujoco.mj_forward(model, data)
        unit, row = np.zeros(model.nv), np.zeros(model.nv)
        unit[self.dof] = 1.0
        self.mujoco.mj_mulM(model, data, row, unit)
        return float(row[self.dof])
