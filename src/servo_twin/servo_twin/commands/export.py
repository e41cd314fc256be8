"""
Write what a simulator can hold of a servo, and say what it cannot and how much that matters.

  servo-twin export S.yaml --format mjcf -o joint.xml
  servo-twin export S.yaml --format urdf --velocity-limit 6 -o joint.urdf
  servo-twin export S.yaml --format isaac --joint knee -o knee_actuator.py

What has no place there is replaced by the nearest that has one. Twin and joint are run over the
same excitation, and the difference is printed and written into the file. More in
docs/simulators.md.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
import re
import shlex
from typing import TYPE_CHECKING

from ..simulators.joint import FORMATS, Joint, ModelError
from .simulator_flags import check_output
from .terminal import named_servo, say, tell

if TYPE_CHECKING:
    from ..physics.servo import Servo
    from ..simulators.to_model.nearest_joint import Nearest

PERIOD = 1e-3  # s


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('servo', type=named_servo, metavar='S.yaml',
                        help='servo file, or the name of a shipped one')
    parser.add_argument('--format', required=True, choices=FORMATS, help='what to write')
    parser.add_argument('-o', '--output', type=Path, required=True, metavar='FILE',
                        help='file to write')
    parser.add_argument('--joint', help="name of the joint (default: the servo's)")
    parser.add_argument('--timestep', type=float, default=PERIOD, metavar='S',
                        help='of the simulator and its controller (default %(default)s)')
    parser.add_argument('--range', type=float, nargs=2, metavar=('LOW', 'HIGH'),
                        help='end stops, rad or m (mjcf, urdf)')
    parser.add_argument('--torque-limit', type=float, metavar='LIMIT',
                        help='most torque at the joint, N m (default: what the servo file says)')
    parser.add_argument('--velocity-limit', type=float, metavar='LIMIT',
                        help='rad/s or m/s (urdf, isaac)')
    over = parser.add_argument_group('the excitation over which both are run')
    over.add_argument('--amplitude', type=float, help='rad, or V of a servo without controller')
    over.add_argument('--frequency', type=float, metavar='HZ', help='of its slower tone')
    over.add_argument('--duration', type=float, metavar='S', help='of the run')
    parser.add_argument('--effects', metavar='FOLDER', help='folder of effect files of your own')


def main(arguments: argparse.Namespace) -> int:
    """Write the file and print what was lost."""
    from ..description.servo_file import load
    from ..physics import catalogue
    from ..simulators.to_model.nearest_joint import nearest_joint, report

    check_output(arguments.output, arguments.force)
    if arguments.effects:
        catalogue.register(arguments.effects)
    _check(arguments)
    servo = load(arguments.servo)
    name = arguments.joint or re.sub(r'[^\w.-]', '_', servo.name)
    nearest = nearest_joint(servo, name, arguments.format, arguments.timestep,
                            arguments.amplitude, arguments.frequency, arguments.duration)
    if arguments.torque_limit is not None:
        nearest = replace(nearest, joint=replace(nearest.joint, torque_limit=min(
            arguments.torque_limit, nearest.joint.torque_limit)))
    nearest = _run(servo, nearest, arguments)
    said = report(nearest)
    origin = f'Made from servo {servo.name} by servo-twin export --format {arguments.format}.'
    arguments.output.write_text(_text(servo, nearest.joint, [origin, *said], arguments))
    tell(arguments, written=[arguments.output], joint=nearest.joint, lost=nearest.lost,
         error={'rms': nearest.rms, 'most': nearest.most, 'motion': nearest.motion,
                'run_by': nearest.by}, said=said)
    say(arguments, f'{arguments.output}:', *said)
    return 0


def _check(arguments: argparse.Namespace) -> None:
    """Raise ModelError for numbers that cannot be."""
    for flag in ('timestep', 'amplitude', 'frequency', 'duration', 'torque_limit',
                 'velocity_limit'):
        value = getattr(arguments, flag)
        if value is not None and not value > 0.0:
            raise ModelError(f'--{flag.replace("_", "-")} {value:g} is not positive')
    if arguments.range and not arguments.range[0] < arguments.range[1]:
        raise ModelError(f'--range {arguments.range[0]:g} {arguments.range[1]:g} is empty')


def _run(servo: Servo, nearest: Nearest, arguments: argparse.Namespace) -> Nearest:
    """Run the joint by MuJoCo where it is MuJoCo's, else by its equation."""
    from ..simulators.to_model.nearest_joint import compared

    if arguments.format != 'mjcf':
        return compared(servo, nearest)
    from ..simulators.mujoco_model import mujoco_library
    from ..simulators.runs.mujoco_run import mujoco_run
    try:
        library = mujoco_library()
    except ModelError:
        return compared(servo, nearest)
    text = _text(servo, nearest.joint, [], _without_stops(arguments))
    by = f'MuJoCo {library.__version__}, a timestep of {arguments.timestep:g} s'
    return compared(servo, nearest, by, lambda joint, over: mujoco_run(text, joint, over))


def _without_stops(arguments: argparse.Namespace) -> argparse.Namespace:
    """Return arguments without end stops, which a comparison must not meet."""
    return argparse.Namespace(**{**vars(arguments), 'range': None})


def _text(servo: Servo, joint: Joint, about: list[str], arguments: argparse.Namespace) -> str:
    from ..simulators.to_model.isaac import isaac_text
    from ..simulators.to_model.mjcf import mjcf_text
    from ..simulators.to_model.urdf import urdf_text

    span = tuple(arguments.range) if arguments.range else None
    if arguments.format == 'mjcf':
        return mjcf_text(joint, arguments.timestep, about, _read_back(servo, joint, arguments),
                         span)
    if arguments.format == 'urdf':
        return urdf_text(joint, about, servo.values['mechanism.ratio'], span,
                         arguments.velocity_limit)
    return isaac_text(joint, about, arguments.velocity_limit)


def _read_back(servo: Servo, joint: Joint, arguments: argparse.Namespace) -> str:
    """Return the command that makes a servo file of the exported one."""
    words = ['servo-twin', 'from-mjcf', arguments.output.name, '--joint', joint.name]
    if not joint.slides:
        words += ['--ratio', repr(servo.values['mechanism.ratio'])]
    words += ['--torque-constant', repr(servo.values['drive.torque_constant'])]
    if joint.back_emf:
        words += ['--resistance', repr(servo.values['drive.resistance'])]
    return shlex.join([*words, '-o', f'{joint.name}.yaml'])
