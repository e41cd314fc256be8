"""An exported MuJoCo file over an excitation, run by MuJoCo."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..actuator_names import FED, POSITION, reference_scale, VELOCITY
from ..joint import Joint, ModelError
from ..mujoco_model import compiled_text, mujoco_library
from .joint_excitation import Excitation


def mujoco_run(text: str, joint: Joint, excitation: Excitation) -> np.ndarray:
    """
    Return the positions that MuJoCo gives an exported joint, rad, shape (samples,).

    The file runs as it is written, one sample of the excitation a timestep. Raises ModelError
    where their periods differ.
    """
    mujoco = mujoco_library()
    model = compiled_text(text, 'the exported file')
    if abs(model.opt.timestep - excitation.period) > 1e-12:
        raise ModelError(f'the timestep of the file is {model.opt.timestep:g} s, the excitation '
                         f'has one sample every {excitation.period:g} s')
    data = mujoco.MjData(model)
    address = model.jnt_qposadr[_place(mujoco, model, 'JOINT', joint.name)]
    data.qpos[address] = excitation.start
    columns = excitation.columns()
    controls = np.zeros((len(excitation.time), model.nu))
    for suffix, column, scale in (
            (POSITION, 'reference_position', 1.0),
            (VELOCITY, 'reference_velocity', reference_scale(joint)), (FED, 'voltage', 1.0)):
        place = _place(mujoco, model, 'ACTUATOR', joint.name + suffix)
        if place >= 0 and column in columns:
            controls[:, place] = scale * columns[column]
    positions = np.empty(len(controls))
    for k, row in enumerate(controls):
        positions[k] = data.qpos[address]
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
    return positions


def _place(mujoco: Any, model: Any, kind: str, name: str) -> int:
    return mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f'mjOBJ_{kind}'), name)
