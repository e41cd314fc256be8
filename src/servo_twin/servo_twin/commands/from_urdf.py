"""
Write a servo file of what a URDF file has of one joint, so that a diagnosis says what it lacks.

  servo-twin from-urdf robot.urdf --joint knee -o knee.yaml
  servo-twin from-urdf robot.urdf --joint knee --at hip=0.3 --kp 40 --kd 1 --armature 0.01 ...

`--joint all` or `--joint hip,knee` writes a servo file of each joint into the folder -o. A value
is for all of them, or of one: --ratio 50 --ratio knee=9.

A URDF file holds masses, damping, friction and limits; gains and armature stand in the simulator
that reads it, and are given by flags. More in docs/simulators.md.
"""

from __future__ import annotations

import argparse
from math import isfinite
from pathlib import Path

from ..simulators.joint import GRAVITY, ModelError
from .each_joint import for_each
from .simulator_flags import add_reading_arguments, check_output, given_of, numbers, write_servo


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('model', type=Path, metavar='ROBOT.urdf', help='URDF file')
    parser.add_argument('--joint', action='append', required=True, metavar='NAME',
                        help='revolute, continuous or prismatic: NAME, NAME,NAME or all')
    parser.add_argument('--armature', action='append', metavar='J',
                        help='inertia of the motor at the joint, kg m2, as the simulator has it '
                             '(default: none, as URDF)')
    parser.add_argument('--gravity', type=float, default=GRAVITY,
                        help='along -z of the root link, m/s2 (default %(default)s)')
    add_reading_arguments(parser)


def main(arguments: argparse.Namespace) -> int:
    """Write the servo file, or that of each joint."""
    from ..simulators.from_model.urdf_model import moving_joints

    return for_each(arguments, lambda: moving_joints(arguments.model), _write)


def _write(arguments: argparse.Namespace) -> int:
    """Write the servo file of one joint."""
    from ..simulators.from_model.urdf_model import joint_of_urdf

    check_output(arguments.output, arguments.force)
    if not isfinite(arguments.gravity):
        raise ModelError(f'--gravity {arguments.gravity:g}: it must be finite; on Earth 9.81 m/s2')
    joint, reduction = joint_of_urdf(arguments.model, arguments.joint,
                                     numbers(arguments.at, '--at'), arguments.gravity)
    more: dict[str, object] = {'armature': arguments.armature}
    if arguments.ratio is None and reduction is not None:
        more |= {'ratio': reduction,
                 'ratio_source': f'{arguments.model.name}: mechanicalReduction of its '
                                 f'transmission'}
    return write_servo(joint, arguments, given_of(arguments, **more), arguments.model)
