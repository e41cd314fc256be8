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
import sys

from servo_twin.commands.terminal import named_servo, new_bag, say, tell, whole_bag

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
    from servo_twin.bag import write_recording

    from ..data.import_memory import memory_of
    from ..data.recording_facts import facts_of
    from ..data.table_import import import_table

    if arguments.block_size < 1:
        raise ValueError(f'--block-size = {arguments.block_size}, it must be at least 1')
    new_bag(arguments.output, arguments.force)
    if arguments.file.exists() and (needed := memory_of(arguments.file)) > SAID_FROM:
        print(f'note: {arguments.file} is held whole while it is imported, which takes about '
              f'{needed / 2**30:.1f} GiB of memory', file=sys.stderr)
    recording = import_table(
        arguments.file, arguments.servo, mapping=arguments.mapping, family=arguments.family,
        replicate=arguments.replicate, note=arguments.note, period=arguments.period)
    for line in recording.note.splitlines():
        if line in recording.warnings:
            print(f'warning: {line}', file=sys.stderr)
        elif not arguments.quiet:
            print(f'note: {line}', file=sys.stderr)
    with whole_bag(arguments.output) as place:
        write_recording(place, recording, arguments.block_size)
    channels = [name for name in recording.columns if recording.has(name)]
    say(arguments, f'{arguments.output}: {len(recording)} samples of {recording.period:.9g} s '
        f'({recording.duration:.6g} s), {", ".join(channels)}'
        + (f'; family {recording.family}' if recording.family else ''))
    tell(arguments, recording=facts_of(arguments.output, recording), written=[arguments.output])
    return 0
