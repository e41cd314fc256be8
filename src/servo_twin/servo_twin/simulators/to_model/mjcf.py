"""A joint as a MuJoCo file."""

from __future__ import annotations

from math import ceil, hypot, inf
from xml.sax.saxutils import quoteattr

from ..actuator_names import FED, POSITION, scaled, VELOCITY
from ..joint import Joint
from .rigid_link import GRAVITY, link_of


def mjcf_text(joint: Joint, timestep: float, about: list[str], read_back: str,
              span: tuple[float, float] | None = None) -> str:
    """
    Return a model with one joint, its load and its actuators.

    ``about`` goes in as comments, ``read_back`` as the text `read_back`, '' as none; ``span``
    (rad) are end stops. Euler with a controller that runs once a timestep, as firmware does; dry
    friction as stiff as MuJoCo solves it at this timestep (2 timesteps).
    """
    link = link_of(joint)
    kind = 'slide' if joint.slides else 'hinge'
    numbers = {'armature': joint.armature, 'damping': joint.damping,
               'frictionloss': joint.friction, 'stiffness': joint.stiffness,
               'springref': joint.rest if joint.stiffness else 0.0}
    said = [f'name={quoteattr(joint.name)}', f'type="{kind}"', f'axis="{_row(*link.axis)}"',
            *(f'{name}="{_row(value)}"' for name, value in numbers.items() if value)]
    if joint.friction:
        said.append(f'solreffriction="{_row(2.0 * timestep, 1.0)}"')
    if joint.torque_limit < inf and (joint.controlled or joint.gain):
        said.append(f'actuatorfrcrange="{_row(-joint.torque_limit, joint.torque_limit)}"')
    if span:
        said.append(f'range="{_row(*span)}"')
    shape = ('<geom type="box" size="0.05 0.05 0.05" contype="0" conaffinity="0"/>'
             if joint.slides or hypot(*link.place) < 0.02 else
             f'<geom type="capsule" fromto="{_row(0.0, 0.0, 0.0, *link.place)}" size="0.01" '
             f'contype="0" conaffinity="0"/>')
    custom = (f'  <custom>\n    <text name="read_back" data={quoteattr(read_back)}/>\n'
              f'  </custom>\n') if read_back else ''
    actuators = '\n'.join(f'    {line}' for line in _actuators(joint, timestep))
    return f"""<mujoco model={quoteattr(joint.name)}>
{comment(about)}
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{timestep!r}" integrator="Euler" gravity="{_row(0.0, 0.0, -GRAVITY)}"/>
{custom}  <worldbody>
    <body name={quoteattr(joint.name + "_link")}>
      <inertial pos="{_row(*link.place)}" mass="{link.mass!r}" diaginertia="{
          _row(link.inertia, link.inertia, link.inertia)}"/>
      <joint {" ".join(said)}/>
      {shape}
    </body>
  </worldbody>
  <actuator>
{actuators}
  </actuator>
</mujoco>
"""


def comment(lines: list[str]) -> str:
    """Return lines as one XML comment, in which two hyphens must not stand together."""
    body = '\n'.join(f'    {line}'.rstrip() for line in lines).replace('--', '- -')
    return f'  <!--\n{body}\n  -->'


def _actuators(joint: Joint, timestep: float) -> list[str]:
    name, lines = joint.name, []
    on = f'joint={quoteattr(name)}'
    if joint.controlled:
        fed = 1.0 if scaled(joint) else joint.kf
        if joint.kp:
            lines.append(f'<position name={quoteattr(name + POSITION)} {on} kp="{_row(joint.kp)}" '
                         f'kv="{_row((1.0 - fed) * joint.kd)}"/>')
        if fed * joint.kd:
            lines.append(f'<velocity name={quoteattr(name + VELOCITY)} {on} '
                         f'kv="{_row(fed * joint.kd)}"/>')
    if joint.gain:
        # a gain that equals its damping would be a velocity servo; behind a gear it does not
        gear = 2.0 if joint.gain == joint.back_emf else 1.0
        lines.append(f'<general name={quoteattr(name + FED)} {on} gear="{gear!r}" '
                     f'gainprm="{_row(joint.gain / gear)}"{_beside(joint, gear, timestep)}/>')
    return lines


def _beside(joint: Joint, gear: float, timestep: float) -> str:
    """Return what a command has beside its gain, as attributes."""
    said = ''
    if joint.back_emf:
        said += f' biastype="affine" biasprm="{_row(0.0, 0.0, -joint.back_emf / gear**2)}"'
    if joint.lag:
        said += f' dyntype="filterexact" dynprm="{_row(joint.lag)}"'
    if joint.delay:
        said += f' delay="{joint.delay!r}" nsample="{ceil(joint.delay / timestep) + 1}"'
    if joint.command_limit < inf:
        said += f' ctrlrange="{_row(-joint.command_limit, joint.command_limit)}"'
    return said


def _row(*values: float) -> str:
    return ' '.join(repr(float(value) if abs(value) > 1e-99 else 0.0) for value in values)
