"""What the commands that read a simulator's joint are asked, and how they write."""

from __future__ import annotations

import argparse
from math import isfinite
from pathlib import Path
import shlex
from typing import TYPE_CHECKING

from ..simulators.joint import Joint, ModelError
from .share import share_of
from .terminal import new_file, say, tell

if TYPE_CHECKING:
    from ..simulators.from_model.required_values import Given


def add_reading_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what a servo file needs beside the model."""
    parser.add_argument('-o', '--output', type=Path, required=True, metavar='S.yaml',
                        help='servo file to write; of several joints the folder for theirs')
    parser.add_argument('--name', help='of the servo (default: file and joint)')
    parser.add_argument('--at', action='append', default=[], metavar='JOINT=VALUE',
                        help='position at which another joint is held, rad or m; may be repeated')
    parser.add_argument('--ratio', action='append',
                        help='turns of the motor for one of the joint, '
                        'rad/m of one that slides (default: 1 by definition, all at the joint)')
    parser.add_argument('--torque-constant', action='append', metavar='KT',
                        help='of the motor, N m/A (default: 1 by definition, the command is the '
                             'torque)')
    parser.add_argument('--kp', action='append',
                        help='stiffness of a controller outside of the model, '
                        'N m/rad at the joint')
    parser.add_argument('--kd', action='append', help='its damping, N m s/rad at the joint')
    parser.add_argument('--torque-limit', action='append', metavar='LIMIT',
                        help='its limit, N m at the joint')
    parser.add_argument('--noise', action='append', default=[], metavar='CHANNEL=VALUE',
                        help='standard deviation of one reading of a channel that is recorded, '
                             'such as motor_position=2e-4 (rad); may be repeated')
    parser.add_argument('--tolerance', type=share_of, metavar='SHARE',
                        help="how far off each value of the model may be, such as '10 %%' or 0.1")


def given_of(arguments: argparse.Namespace, **more: object) -> Given:
    """Return what the flags give; raises ModelError."""
    from ..simulators.from_model.required_values import Given

    return Given(torque_constant=arguments.torque_constant, kp=arguments.kp, kd=arguments.kd,
                 torque_limit=arguments.torque_limit, tolerance=arguments.tolerance,
                 noise=numbers(arguments.noise, '--noise'),
                 **{'ratio': arguments.ratio, **more})


def numbers(given: list[str], flag: str) -> dict[str, float]:
    """Return NAME=VALUE pairs as numbers by name; raises ModelError."""
    found = {}
    for pair in given:
        name, equals, value = pair.partition('=')
        try:
            found[name] = float(value)
        except ValueError:
            equals = ''
        if not (equals and name and isfinite(found[name])):
            raise ModelError(f'{flag} {pair}: it must be NAME=VALUE, with a finite number')
    return found


def check_output(path: Path, force: bool) -> None:
    """Make the folder of a file; raise ModelError where the file must not be written."""
    try:
        new_file(path, force)
    except ValueError as problem:
        raise ModelError(str(problem)) from None


def write_servo(joint: Joint, arguments: argparse.Namespace, given: Given, origin: Path) -> int:
    """Write the servo file of a joint and say what it holds; returns 0."""
    from ..physics.controllers import Open
    from ..recording.joined_samples import reference_of
    from ..simulators.from_model.as_servo import NO_SENSORS, servo_of, text_of

    name = arguments.name or f'{origin.stem}_{joint.name}'
    servo, lacking = servo_of(joint, name, given)
    about = [f'Joint {joint.name!r} of {origin.name}, as the simulator has it: what a diagnosis '
             f'with this', 'file names is what the simulator lacks.']
    arguments.output.write_text(text_of(servo, about, lacking))
    controller = ('no controller' if servo.controller is Open
                  else f'{servo.controller.name} control')
    effects = ', '.join(placed.name for placed in servo.effects) or 'no effects'
    following = f'servo-identify check RECORDING --servo {shlex.quote(str(arguments.output))}'
    columns = ', '.join(('t', 'motor_position', reference_of(servo) or 'voltage'))
    tell(arguments, written=[arguments.output], servo=servo.name, not_in_it=lacking,
         effects=[placed.name for placed in servo.effects], controller=servo.controller.name,
         next=following)
    say(arguments, f'{arguments.output}: {servo.name}, {controller}, {effects}',
        *(f'not in it: {one}' for one in lacking), *([] if servo.sensors else [NO_SENSORS]),
        f'next:    {following}',
        f'         RECORDING of the real joint has the columns {columns} at least; of others '
        '--mapping says which is which')
    return 0
