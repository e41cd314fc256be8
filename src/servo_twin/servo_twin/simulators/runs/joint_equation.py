"""The equation of a joint, as simulators document it, integrated here: no simulator needed."""

from __future__ import annotations

from math import cos, inf, sin

import numpy as np

from ..joint import Joint
from .joint_excitation import Excitation

_STEP = 1e-4  # s, the longest


def equation_run(joint: Joint, excitation: Excitation) -> np.ndarray:
    r"""
    Return the positions of a joint over an excitation, rad, shape (samples,).

    The equation is that of :class:`.joint.Joint`. Dry friction is a torque that stops the joint if
    it can: at rest it holds up to ``friction + stiction``, in motion it takes ``friction``. PhysX
    calls these static and dynamic friction effort, MuJoCo frictionloss, URDF friction, as the
    simulators that read it take it. The controller runs once a sample, and what it asks for is
    held until the next one. Semi-implicit Euler.
    """
    steps = max(1, round(excitation.period / _STEP))
    h = excitation.period / steps
    mass = joint.inertia + joint.armature
    columns = excitation.columns()
    nothing = np.zeros(len(excitation.time))
    command = columns.get('voltage', nothing)
    place = columns.get('reference_position', nothing)
    rate = columns.get('reference_velocity', nothing)
    q, speed, pushed = excitation.start, 0.0, 0.0
    positions = np.empty(len(nothing))
    waiting = [float(command[0]) if len(command) else 0.0] * round(joint.delay / h)
    for k in range(len(nothing)):
        positions[k] = q
        u = min(max(float(command[k]), -joint.command_limit), joint.command_limit)
        held = joint.kp * (place[k] - q) + joint.kd * (joint.kf * rate[k] - speed)
        for _ in range(steps):
            waiting.append(u)
            wanted = joint.gain * waiting.pop(0)
            pushed += (h / (h + joint.lag) if joint.lag else 1.0) * (wanted - pushed)
            torque = pushed - joint.back_emf * speed + held
            if joint.torque_limit < inf:
                torque = min(max(torque, -joint.torque_limit), joint.torque_limit)
            torque -= joint.stiffness * (q - joint.rest)
            torque += joint.cosine if joint.slides else (
                joint.cosine * cos(q) + joint.sine * sin(q))
            speed = _slid(speed, torque, joint, mass, h)
            q += h * speed
    return positions


def _slid(speed: float, torque: float, joint: Joint, mass: float, h: float) -> float:
    """Return the speed a step later: friction stops the joint if it can, else it slows it."""
    if speed == 0.0 and abs(torque) <= joint.friction + joint.stiction:
        return 0.0
    pushed = (speed + h / mass * torque) / (1.0 + h * joint.damping / mass)
    most = h * joint.friction / mass / (1.0 + h * joint.damping / mass)
    slowed = pushed - min(max(pushed, -most), most)
    return 0.0 if slowed * speed < 0.0 and abs(torque) <= joint.friction + joint.stiction else (
        slowed)
