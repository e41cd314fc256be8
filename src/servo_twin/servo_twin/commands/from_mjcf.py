"""
Write a servo file of what MuJoCo has of one joint, so that a diagnosis says what it lacks.

  servo-twin from-mjcf robot.xml --joint knee -o knee.yaml
  servo-twin from-mjcf robot.xml --joint knee --keyframe home --at hip=0.3 -o knee.yaml
  servo-twin from-mjcf robot.xml --joint knee --kp 40 --kd 1 --ratio 9 --torque-constant 0.1 ...

`--joint all` or `--joint hip,knee` writes a servo file of each joint into the folder -o. A value
is for all of them, or of one: --ratio 50 --ratio knee=9.

Each value names where it comes from; what the file lacks of the model is printed and stands in
it. More in docs/simulators.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from .each_joint import for_each
from .simulator_flags import add_reading_arguments, check_output, given_of, numbers, write_servo
from .terminal import say, tell


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('model', type=Path, metavar='ROBOT.xml', help='MJCF file')
    parser.add_argument('--joint', action='append', required=True, metavar='NAME',
                        help='hinge or slide: NAME, NAME,NAME or all')
    parser.add_argument('--keyframe', help='pose at which the rest is held (default: qpos0)')
    parser.add_argument('--actuator', action='append', default=[], metavar='NAME',
                        help='actuator to take, of several on the joint; may be repeated')
    parser.add_argument('--resistance', action='append', metavar='R',
                        help='of the winding, ohm, where the actuator takes a voltage (default: 1 '
                             'by definition)')
    add_reading_arguments(parser)


def main(arguments: argparse.Namespace) -> int:
    """Write the servo file, or that of each joint."""
    from ..simulators.from_model.mujoco_joint import hinges_and_slides
    from ..simulators.mujoco_model import compiled

    return for_each(arguments, lambda: hinges_and_slides(compiled(arguments.model)[0]), _write)


def _write(arguments: argparse.Namespace) -> int:
    """Write the servo file of one joint."""
    from ..simulators.from_model.mujoco_joint import joint_of
    from ..simulators.mujoco_model import compiled

    check_output(arguments.output, arguments.force)
    given = given_of(arguments, resistance=arguments.resistance)
    model, remarks = compiled(arguments.model)
    joint = joint_of(model, arguments.joint, arguments.model.name, arguments.keyframe,
                     numbers(arguments.at, '--at'), arguments.actuator)
    tell(arguments, left_out=remarks)
    say(arguments, *(f'left out of the model: {remark}' for remark in remarks))
    return write_servo(joint, arguments, given, arguments.model)
