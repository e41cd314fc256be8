"""
Look at a recording, ask for the few values it takes, and write a servo file and a mapping file.

  servo-identify init run.csv -o my.yaml

asks on a terminal for all that it cannot see. With flags it asks for less, and without a terminal
it names the flags that are missing. Values have their unit with them, whichever is handy:

  --resistance '350 mohm' --rotor-inertia '32 g cm2' --back-emf '212 rpm/V' --ratio 50

Both files are checked against the recording before they are written.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import shlex
import sys
import tempfile
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import judged_file, say, tell

from ..data.arguments import one_file
from ..init.flag_names import TYPES, VALUES

if TYPE_CHECKING:
    from servo_twin.recording.recording import Recording

    from ..init.machine import Machine


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('data', type=Path, metavar='DATA',
                        help='table, rosbag2 folder or MCAP; one recording of the machine')
    parser.add_argument('-o', '--output', type=Path, required=True, metavar='S.yaml',
                        help='servo file to write')
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
    columns.add_argument('--joint', default='', help='which joint, of messages with several')
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
    parts.add_argument('--tolerance', default='', metavar='SHARE',
                       help="how far off the values may be, such as '10 %%'")
    values = parser.add_argument_group('values, each with its unit')
    for name, kinds in VALUES.items():
        values.add_argument(f'--{name.replace("_", "-")}', metavar="'NUMBER UNIT'",
                            dest=f'value_{name}', help=f'of {", ".join(kinds)}')


def main(arguments: argparse.Namespace) -> int:
    """Ask, check, write; 1 where the recording contradicts what was given."""
    from servo_twin.description import servo_file
    from servo_twin.physics.servo import ServoError

    from ..data.check import check
    from ..data.plausibility import doubt_of_ratio
    from ..init.asking import choose_columns, complete, not_asked_for, with_command
    from ..init.files import mapping_text, servo_text, write
    from ..init.given_columns import given_columns
    from ..init.joint_choice import choose_joint
    from ..init.left_out import left_out, other_angles, reasons, remarks
    from ..init.next_step import next_command, UNUSED, what_it_tells
    from ..init.noise import noise_of
    from ..init.proposals import needs_mapping, proposed, sampled_less_often
    from ..init.sources import offered
    from ..init.torques import as_currents, complete_drive
    from ..init.turns import with_counter, with_signs, with_turns

    arguments.data = one_file(arguments.data, 'init')
    for path in (arguments.output, arguments.mapping_out):
        if path is not None:
            judged_file(path, arguments.force)
    ask = None if arguments.no_questions or not sys.stdin.isatty() else _ask
    of = offered(arguments.data)
    proposals, given = proposed(of, arguments.joint), given_columns(of, arguments.column)
    arguments.joint, missing = choose_joint(of, proposals, given, arguments.joint, ask)
    proposals = proposed(of, arguments.joint)
    columns, more = choose_columns(of, proposals, given, arguments.si, ask, arguments.linear)
    machine = _machine(arguments)
    complete_drive(machine, columns)
    missing += [*more, *complete(machine, columns, ask)]
    if missing:
        units = ['UNIT is one such as V, A, mA, rad, deg, 1/4096 rev (one count of an encoder)']
        raise ValueError('\n  '.join(['init needs to be told:', *missing, *(
            units if any(':UNIT' in one for one in missing) else []), *(
            f'the {section} is {said}' for section, said in machine.chosen.items()), *(
                [UNUSED] if what_it_tells(columns) == 'the transmission' else []), *(
                f'left out: {said}' for said in (*not_asked_for(of), *other_angles(
                    proposals, columns, left_out(of, columns, arguments.joint))))]))
    columns = with_signs(as_currents(with_command(machine, columns), machine), of)
    columns = with_counter(columns, of)
    if arguments.mapping_out is None and needs_mapping(of, columns):
        arguments.mapping_out = judged_file(_beside(arguments.output), arguments.force)
    draft = servo_text(machine, {}, arguments.tolerance)
    try:
        asked = doubt_of_ratio(servo_file.loads(draft, str(arguments.output)))
    except ServoError as problem:
        raise ValueError(f'{problem}{doubt_of_ratio(machine.servo())}') from None
    recording, *others = _read(arguments, draft, mapping_text(of, columns))
    wrapped = with_turns(columns, recording, machine.servo())
    if wrapped != columns:
        columns = wrapped
        if arguments.mapping_out is None:
            arguments.mapping_out = judged_file(_beside(arguments.output), arguments.force)
        recording, *others = _read(arguments, draft, mapping_text(of, columns))
    servo = servo_text(machine, noise_of(recording, machine.servo()), arguments.tolerance)
    findings = check([recording, *others], servo_file.loads(servo, str(arguments.output)))
    for column, one in columns.items():
        turn = f', and wraps around at each {one.wraps:.6g} of them' if one.wraps else ''
        turn += f', read as unsigned of {one.signed} bit' if one.signed else ''
        turn += ', which stands for A' if one.was else ''
        turn += ', with the other sign' if one.negate else ''
        unit = one.was or one.unit or 'SI units'
        say(arguments, f'{column:<20} is {one.source!r} in {unit}{turn}' if one.source else
            f'{column:<20} is counted, {one.every:.6g} s from row to row')
    rare = sampled_less_often(of, columns)
    if rare:
        say(arguments, f'joined               {", ".join(rare)}: sampled less often than other '
                       'columns; a command is held, an angle or a current interpolated')
    left = left_out(of, columns, arguments.joint)
    if left:
        say(arguments, f'left out             {", ".join(map(repr, left))}')
    for said in (*reasons(of, left), *remarks(proposals, columns, left)):
        say(arguments, f'note                 {said}')
    for section, said in machine.chosen.items():
        say(arguments, f'{section:<20} is {said}')
    red = [one for one in findings if one.level == 'red']
    for one in findings:
        if one.level == 'red' or one.level != 'green' and not arguments.quiet:
            print(f'{one.level:5}  {one.sentence}\n       {one.action}')
    tell(arguments, findings=findings, chosen=machine.chosen, columns={
        name: {'source': one.source, 'unit': one.unit} for name, one in columns.items()})
    if red:
        print(f'nothing was written: correct a --column, its unit or a value{asked}',
              file=sys.stderr)
        return 1
    write(arguments.output, servo)
    written = [arguments.output]
    if arguments.mapping_out:
        write(arguments.mapping_out, mapping_text(of, columns))
        written.append(arguments.mapping_out)
    following = shlex.join(next_command(
        arguments.data, arguments.output, arguments.mapping_out)) if what_it_tells(columns) else (
        'record the command or the current: one encoder without both tells nothing')
    tell(arguments, written=written, next=following)
    say(arguments, f'written: {", ".join(map(str, written))}', f'next:    {following}')
    return 0


def _read(arguments: argparse.Namespace, servo: str, mapping: str) -> list[Recording]:
    """Read the recordings by drafts of both files; by its own names where no mapping is needed."""
    from ..data.reading import read_recordings

    with tempfile.TemporaryDirectory(prefix='servo_identify_') as scratch:
        draft, plan = Path(scratch) / 'servo.yaml', Path(scratch) / 'mapping.yaml'
        draft.write_text(servo, 'utf8')
        plan.write_text(mapping, 'utf8')
        return read_recordings([arguments.data], draft,
                               plan if arguments.mapping_out else None)


def _beside(servo: Path) -> Path:
    """Return the mapping file of a servo file, where none is named."""
    return servo.with_name(f'{servo.stem}_columns.yaml')


def _machine(arguments: argparse.Namespace) -> Machine:
    from ..init.machine import flags, Machine

    name = arguments.name or arguments.output.stem
    machine = Machine(name, arguments.linear, {
        section: kind for section in TYPES if (kind := getattr(arguments, section))})
    if 'mechanism' not in machine.parts and _given(arguments, ('stiffness', 'damping')):
        machine.parts['mechanism'] = 'two_inertia'
    # the ratio first: it says in which units the motor of a linear axis is
    for value, owners in sorted(flags().items(), key=lambda item: item[0] != 'ratio'):
        text = getattr(arguments, f'value_{value}')
        if text is None:
            continue
        sections = dict.fromkeys(section for section, kind in owners
                                 if machine.parts.get(section, kind) == kind)
        if not sections:
            kinds = ', '.join(kind for _, kind in owners)
            raise ValueError(f'--{value.replace("_", "-")} is of {kinds}, which this machine is '
                             'not')
        for section in sections:
            if section in machine.parts:
                machine.give(f'{section}.{value}', text)
            else:
                machine.texts[f'{section}.{value}'] = text
    return machine


def _given(arguments: argparse.Namespace, names: Sequence[str]) -> bool:
    return any(getattr(arguments, f'value_{name}') is not None for name in names)


def _ask(question: str, default: str) -> str:
    print(question + (f' [{default}]' if default else ''))
    try:
        return input('> ')
    except EOFError:
        raise ValueError('the questions ended before all was answered') from None
