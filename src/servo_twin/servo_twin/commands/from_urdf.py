"""
Write a servo file of what a URDF file has of one joint, so that a diagnosis says what it lacks.

  servo-twin from-urdf robot.urdf --joint knee -o knee.yaml
  servo-twin from-urdf robot.urdf --joint knee --at hip=0.3 --kp 40 --kd 1 --armature 0.01 ...

A URDF file holds masses, damping, friction and limits; gains and armature stand in the simulator
that reads it, and are given by flags. More in docs/simulators.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..simulators.joint import GRAVITY
from .simulator_flags import add_reading_arguments, check_output, given_of, numbers, write_servo


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('model', type=Path, metavar='ROBOT.urdf', help='URDF file')
    parser.add_argument('--joint', required=True, help='revolute, continuous or prismatic')
    parser.add_argument('--armature', type=float, metavar='J',
                        help='inertia of the motor at the joint, kg m2, as the simulator has it '
                             '(default: none, as URDF)')
    parser.add_argument('--gravity', type=float, default=GRAVITY,
                        help='along -z of the root link, m/s2 (default %(default)s)')
    add_reading_arguments(parser)


def main(arguments: argparse.Namespace) -> int:
    """Write the servo file."""
    from ..simulators.from_model.urdf_model import joint_of_urdf

    check_output(arguments.output, arguments.force)
    joint, reduction = joint_of_urdf(arguments.model, arguments.joint,
                                     numbers(arguments.at, '--at'), arguments.gravity)
    more: dict[str, object] = {'armature': arguments.armature}
    if arguments.ratio is None and reduction is not None:
        more |= {'ratio': reduction,
                 'ratio_source': f'{arguments.model.name}: mechanicalReduction of its '
                                 f'transmission'}
    return write_servo(joint, arguments, given_of(arguments, **more), arguments.model)
