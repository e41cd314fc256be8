"""
Make a bag of a table.

Columns carry the names t, voltage, current_reference, current, motor_position, load_position,
torque, external_torque, reference_position, reference_velocity, temperature, coupled_position,
added_command, in SI units; what is missing is NaN. A header may say a unit: 'motor_position
[deg]'. Other names and messages need a mapping file, which `servo-identify init` writes. Family
and replicate come from the options, a recordings.yaml beside the table, or the mapping file,
whichever is found first.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import shutil
import sys
from typing import Any

from servo_twin.commands.terminal import named_servo, new_bag, say, tell, whole_bag

from ..data.arguments import one_file

IN_PARTS_FROM = 2**27  # bytes of memory from which on a table is not held whole, if it can be
SAID_FROM = 2**30  # bytes of memory from which on they are said


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('file', type=Path, help='table: .csv, .parquet, .npz, .mat or .json; or a '
                        'rosbag2 folder or MCAP of any messages, with a mapping')
    parser.add_argument('--servo', type=named_servo, required=True,
                        help='servo file of the machine, or the name of a shipped one')
    parser.add_argument('-o', '--output', type=Path, required=True, help='bag to create')
    parser.add_argument('--mapping', type=Path, help='how columns become those of a recording; '
                        'config/imports has some')
    parser.add_argument('--family', help='excitation family, such as speed_ladder')
    parser.add_argument('--replicate', type=int, help='1, 2, 3 ... of the same excitation')
    parser.add_argument('--note', help='free text')
    parser.add_argument('--period', type=float, default=0.0,
                        help='s, resample to it; left out, the period of the times')
    parser.add_argument('--block-size', type=int, default=100, help='samples a message')


def main(arguments: argparse.Namespace) -> int:
    """Make the bag and say what is in it."""
    if arguments.block_size < 1:
        raise ValueError(f'--block-size = {arguments.block_size}, it must be at least 1')
    arguments.file = one_file(arguments.file, 'import')
    new_bag(arguments.output, arguments.force)
    with whole_bag(arguments.output) as place:
        found = _written(place, arguments)
    for line in found['note'].splitlines():
        if line in found['warnings']:
            print(f'warning: {line}', file=sys.stderr)
        elif not arguments.quiet:
            print(f'note: {line}', file=sys.stderr)
    say(arguments, f'{arguments.output}: {found["samples"]} samples of {found["period"]:.9g} s '
        f'({found["duration"]:.6g} s), {", ".join(found["channels"])}'
        + (f'; family {found["family"]}' if found['family'] else ''))
    tell(arguments, recording=found, written=[arguments.output])
    return 0


def _written(place: Path, arguments: argparse.Namespace) -> dict[str, Any]:
    """Write the bag, part by part where that can be, and return what is in it."""
    from servo_twin.bag import open_recording, write_recording

    from ..data.import_in_parts import import_in_parts, NotPlain
    from ..data.import_memory import memory_of
    from ..data.recording_facts import facts_of
    from ..data.table_import import import_table

    table, said = arguments.file, {
        'mapping': arguments.mapping, 'family': arguments.family,
        'replicate': arguments.replicate, 'note': arguments.note, 'period': arguments.period}
    needed = memory_of(table) if table.exists() else 0.0
    if needed > IN_PARTS_FROM:
        try:
            head = import_in_parts(table, arguments.servo, place, arguments.block_size, **said)
            with open_recording(place) as whole:
                return facts_of(arguments.output, whole) | {
                    'warnings': list(head.warnings), 'sha256': head.digest}
        except NotPlain:
            shutil.rmtree(place, ignore_errors=True)
    if needed > SAID_FROM:
        print(f'note: {table} is held whole while it is imported, which takes about '
              f'{needed / 2**30:.1f} GiB of memory', file=sys.stderr)
    recording = import_table(table, arguments.servo, **said)
    write_recording(place, recording, arguments.block_size)
    return facts_of(arguments.output, recording)
