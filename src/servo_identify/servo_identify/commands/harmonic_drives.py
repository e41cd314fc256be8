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

from servo_twin.commands.terminal import new_file, tell, terminal

from ..data.arguments import add_data, files, recordings


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    add_data(parser)
    parser.add_argument('--held-out', nargs='+', required=True, metavar='BAG',
                        help='recordings to rank by')
    parser.add_argument('--models', nargs='+', default=(), metavar='NAME',
                        help='which models; default: all. A name that is none lists them')
    parser.add_argument('-o', '--output', type=Path, required=True,
                        help='servo file to write, with the best model')


def main(arguments: argparse.Namespace) -> int:
    """Rank, show and write the best."""
    from rich.table import Table

    from servo_twin.description import servo_file

    from ..jobs.harmonic_drive_ranking import ranked

    files([*arguments.bags, *arguments.held_out])
    new_file(arguments.output, arguments.force)
    console = terminal(quiet=arguments.quiet)
    with console.status('reading') as status:
        sets = [recordings(arguments, bags) for bags in (arguments.bags, arguments.held_out)]
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
    tell(arguments, written=[arguments.output], models=[
        {name: value for name, value in vars(one).items() if name != 'servo'} for one in found])
    return 0
