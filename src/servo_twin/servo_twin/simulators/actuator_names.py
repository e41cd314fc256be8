"""The actuators of an exported MuJoCo file: what they are called and what they are told."""

from __future__ import annotations

from .joint import Joint

POSITION, VELOCITY, FED = '_position', '_velocity', '_command'
"""What follows the joint's name in those of its actuators: references, and the command."""


def reference_scale(joint: Joint) -> float:
    """Return what the reference speed is multiplied by before it is a control."""
    return joint.kf if joint.kd and scaled(joint) else 1.0


def scaled(joint: Joint) -> bool:
    """Whether the share of the reference speed has to be in the control."""
    return joint.kf > 1.0 or (not joint.kp and joint.kf != 1.0)
