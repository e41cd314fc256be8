"""
Hold recordings against a servo file before anything is fitted.

Units, scales, signs, sampling, saturation, excitation, replicates, and what the channels cannot
answer. Each finding says what to do. The exit status is 1 where a finding is red.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack
import sys

from servo_twin.commands.terminal import tell

from ..data.arguments import add_data, opened


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    add_data(parser)


def main(arguments: argparse.Namespace) -> int:
    """Print the findings; 1 where one is red."""
    from servo_twin.description import servo_file
    from servo_twin.description.given_values import defaults

    from ..data.recording_check import check

    servo = servo_file.load(arguments.servo)
    with ExitStack() as stack:
        found = check(opened(arguments, stack), servo)
    taken = defaults(servo)
    tell(arguments, findings=found, defaults=taken)
    for one in found:
        if not arguments.quiet or one.level == 'red':
            print(f'{one.level:5}  {one.sentence}' + (f'\n       {one.action}'
                                                      if one.action else ''))
    if taken and not arguments.quiet:
        meanings = {path: f' ({one.meaning.rstrip(".")})' for path, one in servo.declarations()}
        print('defaults taken, as the servo file does not give them; give those that differ on '
              'your machine:', file=sys.stderr)
        for d in taken:
            print(f'  {d.path} = {d.value} {d.unit}'.rstrip() + meanings.get(d.path, ''),
                  file=sys.stderr)
    return int(any(one.level == 'red' for one in found))
