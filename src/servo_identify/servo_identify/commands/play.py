"""
Measure the backlash of bags, and the curve of it over the setting of a slide.

Each bag goes both ways over the same angles, slowly. With --settings, one number a bag, m, and -o
the servo file gets the curve (effect carrier_backlash).
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import new_file, say, tell

from ..data.arguments import add_data, files, opened

if TYPE_CHECKING:
    from servo_twin.physics.servo import Servo

    from ..learn.transmission.two_way_backlash import Play


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    add_data(parser)
    parser.add_argument('--settings', type=float, nargs='+', metavar='M', default=(),
                        help='where the slide stood in each bag, m')
    parser.add_argument('-o', '--output', type=Path, metavar='NEW.yaml',
                        help='servo file to write with the curve')


def main(arguments: argparse.Namespace) -> int:
    """
    Print the backlash of each bag; write the curve.

    A bag that tells none is named and left out; the status is 1 then.
    """
    from servo_twin.description import servo_file

    from ..learn.transmission.two_way_backlash import slide_of, with_curve

    settings = list(arguments.settings)
    if arguments.output and not settings:
        raise ValueError('--output needs --settings: a curve is over something')
    if len(set(settings)) < len(settings):
        raise ValueError(f'two bags have the same setting: {settings}')
    bags = files(arguments.bags)
    if settings and len(settings) != len(bags):
        raise ValueError(f'there are {len(bags)} bags and {len(settings)} settings; '
                         'give one for each')
    if arguments.output:
        new_file(arguments.output, arguments.force)
    servo = servo_file.load(arguments.servo)
    if arguments.output:
        slide_of(servo, *settings)
    known, refused = [], []
    for k, bag in enumerate(bags):
        try:
            known.append((k, bag, *_measured(arguments, servo, bag)))
        except ValueError as problem:
            refused.append(str(problem))
    tell(arguments, refused=refused, bags=[
        {'bag': bag, 'setting': settings[k] if settings else None, **vars(play)}
        for k, bag, _, play in known])
    for k, bag, _, play in known:
        at = f' at {1e3 * settings[k]:g} mm' if settings else ''
        per, unit = (1e6, 'um') if servo.linear else (1e3, 'mrad')
        say(arguments, f'{bag.name}{at}: {per * play.width:.3f} {unit} ± {per * play.std:.3f}, '
            f'from cell to cell ± {per * play.varies:.3f}, '
            f'beside {per * play.wound:.3f} of torsion')
    for problem in refused:
        print(f'left out: {problem}', file=sys.stderr)
    if not known:
        raise ValueError('no bag is left: none was passed both ways')
    if arguments.output:
        plays = {settings[k]: play for k, _, _, play in known}
        servo_file.save(with_curve(servo, plays, [name for _, _, name, _ in known]),
                        arguments.output)
        tell(arguments, written=[arguments.output])
        say(arguments, f'written to {arguments.output}')
    return 1 if refused else 0


def _measured(arguments: argparse.Namespace, servo: Servo, bag: Path) -> tuple[str, Play]:
    """Return the name of a bag, of any length, and its backlash."""
    from ..fit.estimate import bag_name
    from ..learn.transmission.two_way_backlash import measured_play

    with ExitStack() as stack:
        recording, = opened(arguments, stack, [bag])
        return bag_name(recording), measured_play(servo, recording)
