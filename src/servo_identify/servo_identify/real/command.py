"""
Identify published recordings of real machines and put the figures beside those published.

DATA holds the folders emps, xl330 and two_mass as their authors published them.
"""

from __future__ import annotations

import argparse
from importlib import import_module
import json
from pathlib import Path

MACHINES = {'emps': 'emps', 'xl330': 'xl330', 'two_mass': 'two_mass'}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('data', type=Path, metavar='DATA')
    parser.add_argument('-o', '--output', type=Path, help='JSON file to write the figures to')
    parser.add_argument('--machines', nargs='+', choices=list(MACHINES), default=list(MACHINES))


def main(arguments: argparse.Namespace) -> int:
    """Print the figures of each machine."""
    found = {}
    for machine in arguments.machines:
        folder = arguments.data / MACHINES[machine]
        if not folder.is_dir():
            raise ValueError(f'{folder}: there is no such folder of recordings')
        found[machine] = import_module(f'.{MACHINES[machine]}', __package__).figures(
            arguments.data)
        print('\n'.join(_lines(machine, found[machine])))
    if arguments.output:
        arguments.output.write_text(json.dumps(found, indent=1) + '\n')
    return 0


def _lines(machine: str, figures: dict) -> list[str]:
    if machine == 'emps':
        published = figures['published']
        return ['EMPS, relative errors in % (published):'] + [
            f'  {name.removesuffix("_percent"):11} {figures[name]:8.4f} ({published[name]})'
            for name in published]
    if machine == 'xl330':
        return ['XL330, simulated position error on one-second windows held out, rad '
                '(a quick fit elsewhere):'] + [
            f'  {s:16} {figures[s]["held_out"]["all"]:.4f} ({figures["published"][s]})  '
            + ', '.join(f'{n} {e:.4f}' for n, e in figures[s]['held_out'].items() if n != 'all')
            for s in figures['published']]
    lines = ['Two masses, Hz (measured frequency response):']
    for i, name in enumerate(('antiresonance', 'resonance')):
        ours, truth = figures['fitted'][i], figures['measured'][i]
        lines.append(f'  {name:13} {ours:.2f} ({truth:.2f}), {100 * (ours / truth - 1):+.2f} %')
    return lines
