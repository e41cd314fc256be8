"""A pendulum in MuJoCo whose joint and actuators are given as text."""

from pathlib import Path

from servo_twin.simulators.from_model.mujoco_joint import joint_of
from servo_twin.simulators.mujoco_model import compiled_text

ARM = Path(__file__).resolve().parents[2] / 'config' / 'robots' / 'arm.xml'
PENDULUM = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" integrator="Euler" gravity="0 0 -9.81">{flags}</option>
  <worldbody>
    <body name="arm">
      <inertial pos="0.2 0 -0.1" mass="1.5" diaginertia="0.01 0.02 0.03"/>
      <joint name="j" axis="0 1 0" {joint}/>
    </body>
    <body name="other" pos="0 1 0">
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <joint name="k" axis="0 1 0"/>
    </body>
  </worldbody>
  <actuator>{actuators}</actuator>
</mujoco>
"""
TENDON = """<tendon><fixed name="t" {more}><joint joint="j" coef="3"/><joint joint="k" coef="0.5"/>
            </fixed></tendon>"""
CARRIED = 0.02 + 1.5 * (0.2**2 + 0.1**2)  # kg m2 about the axis, by Steiner


def pendulum(actuators='', joint='', flags='', step=1e-3):
    """Return a model with the joint j, its joint attributes and actuators as given."""
    return compiled_text(PENDULUM.format(step=step, flags=flags, joint=joint,
                                         actuators=actuators), 'pendulum.xml')


def read(actuators='', joint='', flags='', chosen=()):
    """Return the joint j of a pendulum."""
    return joint_of(pendulum(actuators, joint, flags), 'j', 'pendulum.xml', actuators=chosen)


def with_parts(parts, actuators='', bodies=''):
    """Return the joint j of a pendulum with further parts of a model."""
    text = PENDULUM.format(step=1e-3, flags='', joint='', actuators=actuators)
    text = text.replace('</worldbody>', f'{bodies}</worldbody>').replace(
        '</mujoco>', f'{parts}</mujoco>')
    return joint_of(compiled_text(text, 'x'), 'j', 'x')
