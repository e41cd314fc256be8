"""A joint as the actuator of Isaac Lab, and as the drive of an Isaac Sim stage."""

from __future__ import annotations

from math import inf, pi
import re

from ..joint import Joint

_DEGREE = pi / 180.0


def isaac_text(joint: Joint, about: list[str], velocity_limit: float | None = None) -> str:
    """
    Return a Python module with an ImplicitActuatorCfg of Isaac Lab for one joint.

    Friction is the effort of Isaac Sim 5.0 and later: static, dynamic and viscous. The values of
    the stage, which counts angles in degrees, stand in comments. ``about`` is the module's text.
    Source: isaaclab.actuators.ActuatorBaseCfg (Isaac Lab 2.3 and 3.0); PhysX 5.6, articulation
    joint friction.
    """
    rows: list[tuple[str, float, str]] = [
        ('stiffness', joint.kp, joint.unit('N m/rad')),
        ('damping', joint.kd, joint.unit('N m s/rad')),
        ('armature', joint.armature, joint.unit('kg m2')),
        ('friction', joint.friction + joint.stiction,
         joint.unit('N m') + ', static; an effort from Isaac Sim 5.0 on'),
        ('dynamic_friction', joint.friction, joint.unit('N m')),
        ('viscous_friction', joint.damping, joint.unit('N m s/rad')),
    ]
    if joint.torque_limit < inf:
        rows.append(('effort_limit_sim', joint.torque_limit,
                     joint.unit('N m') + '; joint_effort_limit from Isaac Lab 3.0 on'))
    if velocity_limit is not None:
        rows.append(('velocity_limit_sim', velocity_limit,
                     joint.unit('rad') + '/s; joint_velocity_limit from Isaac Lab 3.0 on'))
    values = '\n'.join(f'    {name}={value!r},  # {unit}' for name, value, unit in rows)
    name = constant_of(joint.name)
    return f'''"""
{_docstring(about)}
"""

from isaaclab.actuators import ImplicitActuatorCfg

{name} = ImplicitActuatorCfg(
    joint_names_expr=[{re.escape(joint.name)!r}],
{values}
)

{name}_EFFORT_PER_COMMAND = {joint.gain!r}
"""{joint.unit('N m')} of effort target for one unit of the recorded command (V or A)."""

{name}_VELOCITY_SHARE = {joint.kf!r}
"""The velocity target is this share of the reference speed."""

# On a stage of Isaac Sim the same joint has (angles there are in degrees):
{chr(10).join(_stage(joint))}
'''


def constant_of(name: str) -> str:
    """Return the name of a joint as that of a constant."""
    return re.sub(r'\W', '_', name).upper().lstrip('0123456789_') or 'JOINT'


def _stage(joint: Joint) -> list[str]:
    """Return the attributes of a joint's prim; source: UsdPhysics.DriveAPI, PhysxJointAxisAPI."""
    axis, per = ('linear', 1.0) if joint.slides else ('angular', _DEGREE)
    unit = 'm' if joint.slides else 'deg'
    newton = 'N' if joint.slides else 'N m'
    lines = [f'drive:{axis}:physics:stiffness = {joint.kp * per:.9g}  # {newton}/{unit}',
             f'drive:{axis}:physics:damping = {joint.kd * per:.9g}  # {newton} s/{unit}']
    if joint.torque_limit < inf:
        lines.append(f'drive:{axis}:physics:maxForce = {joint.torque_limit:.9g}  # {newton}')
    prefix = f'physxJointAxis:{axis}'
    lines += [f'{prefix}:armature = {joint.armature:.9g}  # {joint.unit("kg m2")}',
              f'{prefix}:staticFrictionEffort = {joint.friction + joint.stiction:.9g}  # {newton}',
              f'{prefix}:dynamicFrictionEffort = {joint.friction:.9g}  # {newton}',
              f'{prefix}:viscousFrictionCoefficient = {joint.damping * per:.9g}  '
              f'# {newton} s/{unit}']
    return [f'#   {line}' for line in lines]


def _docstring(lines: list[str]) -> str:
    return '\n'.join(lines).replace('\\', '\\\\').replace('"""', "'''")
