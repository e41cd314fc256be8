"""
Which model of a harmonic drive explains a rig best.

Each of the five models of paper 004, and the linear one, is fitted to the same recordings in the
place of the one that the servo file has; all that the file gives a tolerance moves within it. Then
each is run again, as a diagnosis does, over recordings that no fit has seen, and they are ranked
by the gap that remains. The servo file of the best is written.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from servo_twin.cli import named_servo


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('bags', type=Path, nargs='+', metavar='BAG', help='recordings to fit to')
    parser.add_argument('--servo', type=named_servo, required=True,
                        help='servo file of the machine, or the name of a shipped one')
    parser.add_argument('--held-out', type=Path, nargs='+', required=True, metavar='BAG',
                        help='recordings to rank by')
    parser.add_argument('--models', nargs='+', default=(), metavar='NAME',
                        help='which models; default: all. A name that is none lists them')
    parser.add_argument('-o', '--output', type=Path, required=True,
                        help='servo file to write, with the best model')


def main(arguments: argparse.Namespace) -> int:
    """Rank, show and write the best."""
    from rich.console import Console
    from rich.table import Table

    from servo_twin.bag import read_recording
    from servo_twin.description import servo_file

    from ..jobs.harmonic_drive_ranking import ranked

    if not arguments.output.parent.is_dir():
        raise ValueError(f'{arguments.output}: there is no folder {arguments.output.parent}')
    console = Console()
    with console.status('reading') as status:
        sets = [[read_recording(bag) for bag in bags]
                for bags in (arguments.bags, arguments.held_out)]
        found = ranked(servo_file.load(arguments.servo), *sets, names=arguments.models,
                       told=lambda what, share: status.update(f'fitting {what}'))
    shown = Table('model', 'remaining gap', 'shrink', '90 %', 'free', 's',
                  title='Models of the harmonic drive, on recordings nobody fitted to')
    for one in found:
        low, high = one.interval
        shown.add_row(one.title, f'{100 * one.gap:.1f} %', f'{100 * one.shrink:.0f} %',
                      f'{100 * low:.0f} to {100 * high:.0f}', str(one.free),
                      f'{one.seconds:.0f}')
    console.print(shown)
    servo_file.save(found[0].servo, arguments.output)
    console.print(f'{found[0].title} is in {arguments.output}')
    return 0
