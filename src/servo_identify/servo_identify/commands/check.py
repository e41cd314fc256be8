"""
Hold recordings against a servo file before anything is fitted.

Units, scales, signs, sampling, saturation, excitation, replicates, and what the channels cannot
answer. Each finding says what to do. The exit status is 1 where a finding is red.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
import json
from pathlib import Path
import sys


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('data', nargs='+', metavar='BAG', help='bags, tables, or patterns of them')
    parser.add_argument('--servo', required=True, help='servo file, or the name of a shipped one')
    parser.add_argument('--mapping', type=Path, help='how the columns of a table become channels')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write the findings; - prints')


def main(arguments: argparse.Namespace) -> int:
    """Print the findings; 1 where one is red."""
    from servo_twin.description import servo_file
    from servo_twin.description.given_values import defaults
    from servo_twin.description.shipped import servo_at

    from ..data.check import check
    from ..data.reading import read_recordings

    path = servo_at(arguments.servo)
    servo = servo_file.load(path)
    found = check(read_recordings(arguments.data, path, arguments.mapping), servo)
    if arguments.json:
        text = json.dumps({'findings': [asdict(one) for one in found],
                           'defaults': [asdict(one) for one in defaults(servo)]}, indent=1)
        if str(arguments.json) == '-':
            print(text)
        else:
            arguments.json.write_text(text + '\n')
    if str(arguments.json) != '-':
        for one in found:
            print(f'{one.level:5}  {one.sentence}' + (f'\n       {one.action}'
                                                      if one.action else ''))
        taken = defaults(servo)
        if taken:
            print('defaults taken: ' + ', '.join(f'{d.path} = {d.value} {d.unit}'.rstrip()
                                                 for d in taken), file=sys.stderr)
    return int(any(one.level == 'red' for one in found))
