"""A joint as a URDF file."""

from __future__ import annotations

from math import inf
from xml.sax.saxutils import quoteattr

from ..joint import Joint, ModelError
from .mjcf import comment
from .rigid_link import link_of


def urdf_text(joint: Joint, about: list[str], ratio: float = 1.0,
              span: tuple[float, float] | None = None,
              velocity_limit: float | None = None) -> str:
    """
    Return a robot with one joint: its load with the armature in it, damping, friction, limits.

    ``about`` goes in as comments, ``ratio`` as the reduction of a transmission. Raises ModelError
    where URDF asks for a limit that is not given: of the speed beside that of the effort, and of
    the travel of a slide.
    """
    link = link_of(joint, with_armature=True)
    name, body = quoteattr(joint.name), quoteattr(joint.name + '_link')
    x, y, z = link.place
    inertia = link.inertia
    kind = 'prismatic' if joint.slides else 'revolute' if span else 'continuous'
    limit = _limit(joint, span, velocity_limit)
    transmission = '' if ratio == 1.0 else f"""
  <transmission name={quoteattr(joint.name + "_transmission")}>
    <type>transmission_interface/SimpleTransmission</type>
    <joint name={name}>
      <hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>
    </joint>
    <actuator name={quoteattr(joint.name + "_motor")}>
      <mechanicalReduction>{ratio!r}</mechanicalReduction>
    </actuator>
  </transmission>"""
    return f"""<?xml version="1.0"?>
<robot name={name}>
{comment(about)}
  <link name="base"/>
  <link name={body}>
    <inertial>
      <origin xyz="{x!r} {y!r} {z!r}" rpy="0 0 0"/>
      <mass value="{link.mass!r}"/>
      <inertia ixx="{inertia!r}" iyy="{inertia!r}" izz="{inertia!r}" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name={name} type="{kind}">
    <parent link="base"/>
    <child link={body}/>
    <axis xyz="{link.axis[0]!r} {link.axis[1]!r} {link.axis[2]!r}"/>{limit}
    <dynamics damping="{joint.damping!r}" friction="{joint.friction!r}"/>
  </joint>{transmission}
</robot>
"""


def _limit(joint: Joint, span: tuple[float, float] | None, velocity_limit: float | None) -> str:
    if joint.slides and span is None:
        raise ModelError(f'joint {joint.name!r} slides, and URDF wants to know how far: give '
                         f'--range LOW HIGH in m')
    needed = span is not None or joint.torque_limit < inf
    if needed and velocity_limit is None:
        raise ModelError(f'joint {joint.name!r} has a limit of {"travel" if span else "effort"}, '
                         f'and URDF wants one of the speed beside it: give --velocity-limit in '
                         f'{joint.unit("rad")}/s')
    if not needed and velocity_limit is None:
        return ''
    effort = joint.torque_limit
    if effort == inf:
        raise ModelError(f'joint {joint.name!r} has no limit of effort, and URDF wants one '
                         f'beside the others: give --torque-limit in {joint.unit("N m")}')
    ends = f' lower="{span[0]!r}" upper="{span[1]!r}"' if span else ''
    return f'\n    <limit effort="{effort!r}" velocity="{velocity_limit!r}"{ends}/>'
