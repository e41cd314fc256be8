"""
Make a bag of a table, or of each of several.

Columns carry the names t, voltage, current_reference, current, motor_position, load_position,
torque, external_torque, reference_position, reference_velocity, temperature, coupled_position,
added_command, in SI units; what is missing is NaN. An external torque is positive where it
resists the load. A header may say a unit: 'motor_position [deg]'. Other names and messages need a
mapping file, which `servo-identify init` writes. Family and replicate come from the options, a
recordings.yaml beside the table, or the mapping file, whichever is found first.

Of several tables, a pattern of them or a folder, each becomes a bag of its own name in the folder
-o. One that cannot be is left out with its reason, and the exit status is 1 then.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
import shutil
import sys
from typing import Any, TYPE_CHECKING

from servo_twin.commands.terminal import named_servo, new_bag, say, tell, whole_bag

from ..data.arguments import add_stretch, names_of, stretch_of, tables_of

if TYPE_CHECKING:
    from servo_twin.recording.recording import Recording

    from ..data.long_bags import Long

IN_PARTS_FROM = 2**27  # bytes of memory from which on a table is not held whole, if it can be
SAID_FROM = 2**30  # bytes of memory from which on they are said


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('files', type=Path, nargs='+', metavar='file',
                        help='table: .csv, .parquet, .npz, .mat, .h5, .xlsx or .json; or a '
                        'rosbag2 folder or MCAP of any messages, with a mapping; several, a '
                        'pattern or a folder of tables make a bag each')
    parser.add_argument('--servo', type=named_servo, required=True,
                        help='servo file of the machine, or the name of a shipped one')
    parser.add_argument('-o', '--output', type=Path, required=True,
                        help='bag to create; of several tables the folder of their bags')
    parser.add_argument('--mapping', type=Path, help='how columns become those of a recording; '
                        'config/imports has some')
    parser.add_argument('--family', help='excitation family, such as speed_ladder')
    parser.add_argument('--replicate', type=int, help='1, 2, 3 ... of the same excitation; of '
                        'several tables that of the first, and one more for each that follows')
    parser.add_argument('--note', help='free text')
    parser.add_argument('--period', type=float, default=0.0,
                        help='s, resample to it; left out, the period of the times')
    add_stretch(parser)
    parser.add_argument('--block-size', type=int, default=100, help='samples a message')


def main(arguments: argparse.Namespace) -> int:
    """Make the bags and say what is in them; 1 where one was left out, 2 where all were."""
    if arguments.block_size < 1:
        raise ValueError(f'--block-size = {arguments.block_size}, it must be at least 1')
    tables = tables_of(arguments.files)
    if len(tables) == 1 and not _in_folder(arguments):
        table, = tables
        made, left = _bags_of(table, arguments.output, arguments, arguments.replicate)
        _say_notes(arguments, {output.name: found for output, found in made.items()})
        for output, found in made.items():
            say(arguments, _sentence(output, found))
        told = {'recordings': [*made.values()]} if len(made) > 1 else {
            'recording': next(iter(made.values()))}
        tell(arguments, **told, left_out=left, written=[*made])
        return int(bool(_said(left)))
    return _several(tables, arguments)


def _in_folder(arguments: argparse.Namespace) -> bool:
    """Tell whether a folder of tables was named, so that -o is a folder however many it holds."""
    from ..data.message_files import holds_messages

    return any(path.is_dir() and not holds_messages(path) for path in arguments.files)


def _several(tables: list[Path], arguments: argparse.Namespace) -> int:
    """Make a bag of each table; one that cannot be is said at once, and the rest go on."""
    from servo_twin.description import servo_file

    from ..data.mapping import read_mapping
    from ..data.message_files import holds_messages

    folder = arguments.output
    if folder.is_file() or holds_messages(folder):
        raise ValueError(f'{folder} is a {"file" if folder.is_file() else "bag"}, and the bags of '
                         f'{len(tables)} tables need a folder; choose another -o')
    servo_file.load(arguments.servo)  # what is wrong in either is wrong for all
    if arguments.mapping:
        read_mapping(arguments.mapping)
    made, left = dict[str, dict[str, Any]](), dict[str, str]()
    for k, (table, name) in enumerate(zip(tables, names_of(tables), strict=True)):
        number = None if arguments.replicate is None else arguments.replicate + k
        try:
            bags, runs = _bags_of(table, folder / name, arguments, number)
        except (ValueError, OSError) as problem:
            said = str(problem)
            left |= _said({str(table): said if str(table) in said else f'{table}: {said}'})
        else:
            left |= _said(runs)
            for output, found in bags.items():
                say(arguments, _sentence(output, found))
                made[str(output.relative_to(folder))] = found
    _say_notes(arguments, made)
    written = [folder / name for name in made]
    tell(arguments, recordings=list(made.values()), left_out=left, written=written)
    whole = len(tables) - len(left.keys() & {str(table) for table in tables})
    summary = f'{whole} of {len(tables)} tables are bags in {folder}'
    if left:
        print(f'{summary}; left out, for the reasons above: {", ".join(left)}', file=sys.stderr)
    else:
        say(arguments, summary)
    return 2 if not made else int(bool(left))


def _said(left: dict[str, str]) -> dict[str, str]:
    """Say why something was left out, and return it."""
    for reason in left.values():
        print(f'servo-identify import: {reason}', file=sys.stderr)
    return left


def _bags_of(table: Path, output: Path, arguments: argparse.Namespace, replicate: int | None
             ) -> tuple[dict[Path, dict[str, Any]], dict[str, str]]:
    """
    Write the bag of a table; return what is in it by its path, and why which run was left out.

    Of a table of several recordings, ``output`` is the folder of a bag for each.
    """
    from servo_twin.bag import write_recording

    from ..data.import_memory import memory_of
    from ..data.message_files import holds_messages
    from ..data.stretch import ALL
    from ..data.table_import import import_runs

    folder = output.is_dir() and not holds_messages(output)  # of the bags of several runs, maybe
    if not folder:
        new_bag(output, arguments.force)
    said = {'mapping': arguments.mapping, 'family': arguments.family, 'replicate': replicate,
            'note': arguments.note, 'period': arguments.period}
    needed, stretch = memory_of(table) if table.exists() else 0.0, stretch_of(arguments)
    if needed > IN_PARTS_FROM and not folder and stretch == ALL:
        found = _in_parts(table, output, arguments, said)
        if found:
            return {output: found}, {}
    if needed > SAID_FROM:
        print(f'note: {table} is held whole while it is imported, which takes about '
              f'{needed / 2**30:.1f} GiB of memory', file=sys.stderr)
    (recordings, left), made = import_runs(table, arguments.servo, **said, stretch=stretch), {}
    for one in recordings:
        bag = output if len(recordings) + len(left) == 1 else output / one.name
        new_bag(bag, arguments.force)
        with whole_bag(bag) as place:
            write_recording(place, one, arguments.block_size)
        made[bag] = _facts(bag, one, arguments.servo)
    return made, {f'{table.name}, {run}': said for run, said in left.items()}


def _in_parts(table: Path, output: Path, arguments: argparse.Namespace, said: dict[str, Any]
              ) -> dict[str, Any] | None:
    """Write the bag part by part and return what is in it; None where that cannot be."""
    from servo_twin.bag import open_recording

    from ..data.import_in_parts import import_in_parts, NotPlain

    with whole_bag(output) as place:
        try:
            head = import_in_parts(table, arguments.servo, place, arguments.block_size, **said)
            with open_recording(place) as whole:
                return _facts(output, whole, arguments.servo) | {
                    'warnings': list(head.warnings), 'sha256': head.digest}
        except NotPlain:
            shutil.rmtree(place, ignore_errors=True)
    return None


def _sentence(output: Path, found: dict[str, Any]) -> str:
    return (f'{output}: {found["samples"]} samples of {found["period"]:.9g} s '
            f'({found["duration"]:.6g} s), {", ".join(found["channels"])}'
            + (f'; family {found["family"]}' if found['family'] else ''))


def _say_notes(arguments: argparse.Namespace, made: dict[str, dict[str, Any]]) -> None:
    """
    Print what was changed or is to be minded, once for all tables that it is of.

    Lines that differ in their numbers alone are one, with the numbers of the first table.
    """
    from ..data.finding import without_numbers

    lines = dict[tuple[str, bool], list[tuple[str, str]]]()
    for name, found in made.items():
        told = [(line, line in found['warnings']) for line in found['note'].splitlines()]
        own = f'{Path(found["path"]).name}: '
        told += [(f'{one.sentence.removeprefix(own)} What to do: {one.action}', True)
                 for one in found['findings']]
        for line, warned in told:
            lines.setdefault((without_numbers(line), warned), []).append((name, line))
    for (_, warned), said in lines.items():
        names = ', '.join(name for name, _ in said)
        first = f'; the numbers are of {said[0][0]}' if len({line for _, line in said}) > 1 else ''
        if warned or not arguments.quiet:
            print(('warning: ' if warned else 'note: ') + said[0][1]
                  + (f' ({names}{first})' if len(made) > 1 else ''), file=sys.stderr)


def _facts(output: Path, recording: Long, servo: Path) -> dict[str, Any]:
    """
    Return what is in a bag, and what would be wrong of it as it is: ``findings``.

    A long bag is read once for both.
    """
    from servo_twin.description import servo_file
    from servo_twin.recording.parts import parts_of

    from ..data.raw_encoder import wrapped_findings
    from ..data.recording_facts import facts_of
    from ..data.survey import wrapped_in

    machine, wrapped = servo_file.load(servo), dict[str, float]()

    def watched() -> Iterator[Recording]:
        for part in parts_of(recording):
            wrapped.update(wrapped_in(part, machine))
            yield part

    return facts_of(output, recording, watched()) | {
        'findings': list(wrapped_findings(output.name, wrapped))}
