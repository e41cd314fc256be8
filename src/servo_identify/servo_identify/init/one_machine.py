"""One machine of a recording: what was asked for, what is still missing, and the two files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
import tempfile

from servo_twin.description import servo_file
from servo_twin.physics.servo import ServoError
from servo_twin.physics.step_limit import doubt_of_ratio
from servo_twin.recording.recording import Recording

from ..data.finding import Finding
from ..data.reading import read_recordings
from ..data.recording_check import check
from .asking import choose_columns, complete, not_asked_for
from .files import mapping_text, servo_text
from .given_columns import given_columns
from .hints import phases
from .joint_choice import choose_joint
from .left_out import left_out, other_angles, reasons, remarks
from .machine import flag, flags, Machine, SECTIONS
from .next_step import UNUSED, what_it_tells
from .proposals import doubt_of_time, needs_mapping, Proposal, proposed, sampled_less_often
from .questions import Ask
from .sensor_noise import noise_of
from .sources import Offered
from .torques import as_currents, complete_drive
from .turns import with_counter, with_signs, with_turns


@dataclass(frozen=True)
class Wanted:
    """
    What was asked for of one machine.

    ``parts`` maps a section to its type, ``values`` a value's name to its text, ``columns`` are
    COLUMN=SOURCE:UNIT. ``mapping`` is the mapping file to write where one is asked for, and
    ``si`` says that what has no unit is in SI units.
    """

    name: str
    output: Path
    mapping: Path | None = None
    joint: str = ''
    columns: tuple[str, ...] = ()
    parts: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, str] = field(default_factory=dict)
    si: bool = False
    linear: bool = False
    tolerance: str = ''

    @property
    def beside(self) -> Path:
        """The mapping file that is written where one is needed."""
        return self.mapping or self.output.with_name(f'{self.output.stem}_columns.yaml')


@dataclass(frozen=True)
class Draft:
    """A machine as far as it is known; ``missing`` are the flags that are needed still."""

    wanted: Wanted
    of: Offered
    machine: Machine
    proposals: Mapping[str, Sequence[Proposal]]
    columns: Mapping[str, Proposal]
    missing: tuple[str, ...]

    @property
    def remarks(self) -> list[str]:
        """What is to be said beside the flags that are missing."""
        units = ['UNIT is one such as V, A, mA, rad, deg, 1/4096 rev (one count of an encoder)']
        return [*(units if any(':UNIT' in one for one in self.missing) else []),
                *(phases(self.of.sources) if not self.wanted.joint else []),
                *(f'the {section} is {said}' for section, said in self.machine.chosen.items()),
                *([UNUSED] if what_it_tells(self.columns) == 'the transmission' else []),
                *(f'left out: {said}' for said in (*not_asked_for(self.of), *other_angles(
                    self.proposals, self.columns,
                    left_out(self.of, self.columns, self.wanted.joint))))]


@dataclass(frozen=True)
class Made:
    """Both files of a machine, ``mapping`` '' where none is needed, and what was found."""

    draft: Draft
    columns: Mapping[str, Proposal]
    servo: str
    mapping: str
    findings: tuple[Finding, ...]
    doubt: str

    @property
    def red(self) -> list[Finding]:
        """What contradicts the values or the units that were given."""
        return [one for one in self.findings if one.level == 'red']

    def lines(self) -> list[str]:
        """Return what is said of columns and parts, one line each."""
        of, joint = self.draft.of, self.draft.wanted.joint
        said = [_told(name, one) for name, one in self.columns.items()]
        rare = sampled_less_often(of, self.columns)
        if rare:
            said.append(f'joined               {", ".join(rare)}: sampled less often than other '
                        'columns; a command is held, an angle or a current interpolated')
        left = left_out(of, self.columns, joint)
        if left:
            said.append(f'left out             {", ".join(map(repr, left))}')
        said += [f'note                 {one}' for one in (
            *reasons(of, left), *remarks(self.draft.proposals, self.columns, left),
            *(phases(of.sources) if not joint else []))]
        return said + [f'{section:<20} is {one}'
                       for section, one in self.draft.machine.chosen.items()]


def draft_of(wanted: Wanted, of: Offered, ask: Ask | None) -> Draft:
    """Return what is known of a machine; raises ValueError for flags that cannot be."""
    proposals, given = proposed(of), given_columns(of, wanted.columns)
    joint, missing = choose_joint(of, proposals, given, wanted.joint, ask)
    wanted = replace(wanted, joint=joint)
    proposals = proposed(of, joint)
    columns, more = choose_columns(of, proposals, given, wanted.si, ask, wanted.linear)
    machine = _machine(wanted)
    complete_drive(machine, columns)
    return Draft(wanted, of, machine, proposals, columns,
                 (*missing, *more, *complete(machine, columns, ask)))


def made_of(draft: Draft) -> Made:
    """Return both files of a machine with nothing missing, checked against its recording."""
    of, machine, wanted = draft.of, draft.machine, draft.wanted
    columns = with_signs(as_currents(draft.columns, machine), of)
    columns = with_counter(columns, of)
    mapped = wanted.mapping is not None or needs_mapping(of, columns)
    text = servo_text(machine, {}, wanted.tolerance)
    try:
        doubt = doubt_of_ratio(servo_file.loads(text, str(wanted.output)))
    except ServoError as problem:
        raise ValueError(f'{problem}{doubt_of_ratio(machine.servo())}') from None
    recording, *others = _read(of, text, mapping_text(of, columns) if mapped else '')
    wrapped = with_turns(columns, recording, machine.servo())
    if wrapped != columns:
        columns, mapped = wrapped, True
        recording, *others = _read(of, text, mapping_text(of, columns))
    servo = servo_text(machine, noise_of(recording, machine.servo()), wanted.tolerance)
    found = check([recording, *others], servo_file.loads(servo, str(wanted.output)))
    return Made(draft, columns, servo, mapping_text(of, columns) if mapped else '', tuple(found),
                doubt + doubt_of_time(of, columns['t']))


def _read(of: Offered, servo: str, mapping: str) -> list[Recording]:
    """Read the recordings by drafts of both files; by its own names where no mapping is needed."""
    with tempfile.TemporaryDirectory(prefix='servo_identify_') as scratch:
        draft, plan = Path(scratch) / 'servo.yaml', Path(scratch) / 'mapping.yaml'
        draft.write_text(servo, 'utf8')
        plan.write_text(mapping, 'utf8')
        return read_recordings([of.path], draft, plan if mapping else None)


def _machine(wanted: Wanted) -> Machine:
    machine = Machine(wanted.name, wanted.linear, dict(wanted.parts))
    if 'mechanism' not in machine.parts and wanted.values.keys() & {'stiffness', 'damping'}:
        machine.parts['mechanism'] = 'two_inertia'
    # the ratio first: it says in which units the motor of a linear axis is
    for value, owners in sorted(flags().items(), key=lambda item: item[0] != 'ratio'):
        text = wanted.values.get(value)
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
    loop = [flag(path) for path in machine.texts if path.startswith('controller.')]
    if loop and 'controller' not in machine.parts:
        kinds = ', '.join(kind for kind in SECTIONS['controller'] if kind != 'none')
        raise ValueError(f'{", ".join(loop)}: of which controller? Say --controller, one of '
                         f'{kinds}')
    return machine


def _told(column: str, one: Proposal) -> str:
    """Return how a column was taken."""
    if not one.source:
        return f'{column:<20} is counted, {one.every:.6g} s from row to row'
    turn = f', and wraps around at each {one.wraps:.6g} of them' if one.wraps else ''
    turn += f', read as unsigned of {one.signed} bit' if one.signed else ''
    turn += ', which stands for A' if one.was else ''
    turn += ', with the other sign' if one.negate else ''
    if one.source.isupper() and one.unit not in one.source and one.unit.upper() in one.source:
        turn += ': capitals do not tell m from M, and no channel is in millions'
    return f'{column:<20} is {one.source!r} in {one.was or one.unit or "SI units"}{turn}'
