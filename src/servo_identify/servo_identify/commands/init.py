"""
Look at a recording, ask for the few values it takes, and write a servo file and a mapping file.

  servo-identify init run.csv -o my.yaml

asks on a terminal for all that it cannot see. With flags it asks for less, and without a terminal
it names the flags that are missing. Values have their unit with them, whichever is handy:

  --resistance '350 mohm' --rotor-inertia '32 g cm2' --back-emf '212 rpm/V' --ratio 50

Both files are checked against the recording before they are written.

Of a robot that logs several joints, `--joint all` or `--joint elbow,knee` writes both files of
each into the folder -o, and rigs.yaml for `servo-identify diagnose --jobs`. In a --column {joint}
stands for the name of the joint, and a value may be of one: --ratio 50 --ratio 'elbow=100'.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import shlex
import sys
from typing import TYPE_CHECKING

from servo_twin.commands.share import share_of
from servo_twin.commands.terminal import judged_file, new_folder, say, tell
from servo_twin.description.joint_names import are_several

from ..data.arguments import one_file
from ..init.flag_names import TYPES, VALUES

if TYPE_CHECKING:
    from ..init.one_machine import Made, Wanted
    from ..init.sources import Offered


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('data', type=Path, metavar='DATA',
                        help='table, rosbag2 folder or MCAP; one recording of the machine')
    parser.add_argument('-o', '--output', type=Path, required=True, metavar='S.yaml',
                        help='servo file to write; of several joints the folder for theirs')
    parser.add_argument('--mapping-out', type=Path, metavar='M.yaml',
                        help='mapping file to write (default: S_columns.yaml beside the servo '
                        'file, where the columns have other names or units than ours)')
    parser.add_argument('--no-questions', action='store_true',
                        help='ask nothing, as without a terminal')
    parser.add_argument('--name', help="of the servo (default: the output's)")
    columns = parser.add_argument_group('the columns')
    columns.add_argument('--column', action='append', default=[], metavar='COLUMN=SOURCE:UNIT',
                         help='which source is which column, such as motor_position=theta:deg '
                              'or motor_position=enc:1/4096 rev, current=raw:2.69 mA; '
                              'load_position=-q turns the sign, t=:2 ms counts rows without '
                              'times; may be repeated')
    columns.add_argument('--joint', action='append', default=[], metavar='NAME',
                         help='which joint of several: NAME, NAME,NAME or all')
    columns.add_argument('--si', action='store_true',
                         help='what has no unit in its header is in SI units')
    parts = parser.add_argument_group('the machine')
    for section, types in TYPES.items():
        parts.add_argument(f'--{section}', choices=list(types), metavar='TYPE',
                           help=f'one of {", ".join(types)}')
    parts.add_argument('--linear', action='store_true',
                       help='the load moves straight, in m, N and kg; of a motor that turns '
                       "give the --ratio in rad/m, or as a lead such as '40 mm/rev'; a linear "
                       "motor has --ratio 1")
    parts.add_argument('--tolerance', type=share_of, metavar='SHARE',
                       help="how far off the values may be, such as '10 %%' or 0.1")
    values = parser.add_argument_group('values, each with its unit')
    for name, kinds in VALUES.items():
        values.add_argument(f'--{name.replace("_", "-")}', metavar="'NUMBER UNIT'",
                            action='append', dest=f'value_{name}', help=f'of {", ".join(kinds)}')


def main(arguments: argparse.Namespace) -> int:
    """Ask, check, write; 1 where the recording contradicts what was given."""
    from ..init.next_step import next_command, what_it_tells
    from ..init.one_machine import draft_of, made_of
    from ..init.sources import offered

    arguments.data = one_file(arguments.data, 'init')
    several = are_several(arguments.joint)
    for path in (arguments.mapping_out, None if several else arguments.output):
        if path is not None:
            judged_file(path, arguments.force)
    if several:
        return _several(arguments, offered(arguments.data))
    ask = None if arguments.no_questions or not sys.stdin.isatty() else _ask
    draft = draft_of(_wanted(arguments), offered(arguments.data), ask)
    if draft.missing:
        raise ValueError('\n  '.join(['init needs to be told:', *draft.missing, *draft.remarks]))
    made = made_of(draft)
    if made.mapping:
        judged_file(draft.wanted.beside, arguments.force)
    say(arguments, *made.lines())
    _say_findings(arguments, made)
    tell(arguments, findings=made.findings, chosen=draft.machine.chosen, columns=_columns(made))
    if made.red:
        print(f'nothing was written: correct a --column, its unit or a value{made.doubt}',
              file=sys.stderr)
        return 1
    written = _write(made)
    following = shlex.join(next_command(
        arguments.data, arguments.output, draft.wanted.beside if made.mapping else None)) if (
        what_it_tells(made.columns)) else (
        'record the command or the current: one encoder without both tells nothing')
    tell(arguments, written=written, next=following)
    say(arguments, f'written: {", ".join(map(str, written))}', f'next:    {following}')
    return 0


def _several(arguments: argparse.Namespace, of: Offered) -> int:
    """Write the files of several joints and their jobs; 1 where one contradicts what was given."""
    from ..init.files import write
    from ..init.one_machine import draft_of, made_of
    from ..init.several_joints import JOBS, jobs_text, missing_of_all, of_joint, wanted_joints

    folder = arguments.output
    if arguments.mapping_out is not None or folder.suffix in ('.yaml', '.yml'):
        raise ValueError(f'of several joints -o is a folder, not {folder}, into which servo file '
                         'and mapping of each are written; --mapping-out is of one joint')
    joints = wanted_joints(of, arguments.joint)
    values = {name: texts for name in VALUES if (texts := getattr(arguments, f'value_{name}'))}
    drafts = [draft_of(of_joint(_wanted(arguments), joint, joints, values), of, None)
              for joint in joints]
    new_folder(folder, arguments.force, JOBS,
               *(path.name for one in drafts for path in (one.wanted.output, one.wanted.beside)))
    missing = missing_of_all(drafts)
    if missing:
        raise ValueError('\n  '.join([f'init needs to be told of {", ".join(joints)}:', *missing]))
    written, kept, told = list[Path](), list['Made'](), dict[str, object]()
    for draft in drafts:
        joint = draft.wanted.joint
        try:
            made = made_of(draft)
        except ValueError as problem:
            print(f'{joint}: {problem}', file=sys.stderr)
            told[joint] = {'error': str(problem)}
            continue
        say(arguments, f'{joint}:', *(f'  {one}' for one in made.lines()
                                      if not one.startswith('left out')))
        _say_findings(arguments, made)
        told[joint] = {'findings': made.findings, 'columns': _columns(made)}
        if not made.red:
            kept.append(made)
            written += _write(made)
    left = [one.wanted.joint for one in drafts if one not in [made.draft for made in kept]]
    if left:
        print(f'nothing was written of {", ".join(left)}, for the reasons above', file=sys.stderr)
    if kept:
        write(folder / JOBS, jobs_text(folder, kept))
        written.append(folder / JOBS)
        following = shlex.join(['servo-identify', 'diagnose', '--jobs', str(folder / JOBS), '-o',
                                'answers'])
        tell(arguments, next=following)
        say(arguments, f'written: {", ".join(map(str, written))}', f'next:    {following}')
    tell(arguments, joints=told, written=written, left_out=left)
    return int(bool(left))


def _columns(made: Made) -> dict[str, dict[str, str]]:
    return {name: {'source': one.source, 'unit': one.unit} for name, one in made.columns.items()}


def _write(made: Made) -> list[Path]:
    """Write both files and return their paths."""
    from ..init.files import write

    wanted = made.draft.wanted
    files = {wanted.output: made.servo} | ({wanted.beside: made.mapping} if made.mapping else {})
    for path, text in files.items():
        write(path, text)
    return [*files]


def _say_findings(arguments: argparse.Namespace, made: Made) -> None:
    for one in made.findings:
        if one.level == 'red' or one.level != 'green' and not arguments.quiet:
            print(f'{one.level:5}  {one.sentence}\n       {one.action}')


def _wanted(arguments: argparse.Namespace) -> Wanted:
    from ..init.one_machine import Wanted

    values = {name: texts[-1] for name in VALUES
              if (texts := getattr(arguments, f'value_{name}'))}
    parts = {section: kind for section in TYPES if (kind := getattr(arguments, section))}
    return Wanted(arguments.name or arguments.output.stem, arguments.output,
                  arguments.mapping_out, (arguments.joint or [''])[-1], tuple(arguments.column),
                  parts, values, arguments.si, arguments.linear,
                  f'{100.0 * arguments.tolerance:g} %' if arguments.tolerance else '')


def _ask(question: str, default: str) -> str:
    print(question + (f' [{default}]' if default else ''))
    try:
        return input('> ')
    except EOFError:
        raise ValueError('the questions ended before all was answered') from None
