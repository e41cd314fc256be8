"""What init must know, by flags or by questions: columns, parts, values with their units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
import re
import shlex

from servo_twin.description.nearest_name import or_what
from servo_twin.physics.straight_units import straightened

from ..data.column_names import ANGLE, is_share, looks_like, NAMES
from ..data.column_units import COMMANDS, UNIT
from ..data.finding import SHOWN
from .given_columns import judge_unit
from .machine import ABOUT, example, flag, Machine, SECTIONS
from .proposals import may_be_angle, Proposal, rises
from .sources import Offered
from .torques import choose_torques

Ask = Callable[[str, str], str]
"""Asks a question with the answer that Enter stands for ('' for none); returns the answer."""

ENCODERS = ('motor_position', 'load_position')


def choose_columns(of: Offered, proposals: Mapping[str, Sequence[Proposal]],
                   given: Mapping[str, Proposal], si: bool, ask: Ask | None,
                   linear: bool = False) -> tuple[dict[str, Proposal], list[str]]:
    """
    Return the columns, and the flags that are missing for them where nothing can be asked.

    ``si``: numbers of which nothing says the unit are in SI units. ``linear``: the load moves
    straight, and its unit is m where nothing else is said.
    """
    chosen = dict(given)
    missing: list[str] = []
    taken = {one.source for one in chosen.values()}
    for column in NAMES:
        several = [one for one in proposals.get(column, ()) if one.source not in taken]
        if column in chosen or not several:
            continue
        if len(several) == 1:
            chosen[column] = several[0]
        elif ask:
            answer = _one_of(ask, f'Which is {column}', [one.source for one in several])
            chosen[column] = next((one for one in several if one.source == answer),
                                  Proposal(column, answer, ''))
        else:
            joints = _joints([one.source for one in several])
            missing.append(f'--joint NAME (of {joints})' if joints else
                           f'--column {column}=SOURCE (of {[one.source for one in several]})')
        taken |= {chosen[column].source} if column in chosen else set()
    if not any(one.startswith('--joint') for one in missing):  # whose torque it is
        pick = partial(_one_of, ask, usual='') if ask else None
        chosen, untold = choose_torques(of, proposals, chosen, pick)
        missing += untold
    taken |= {one.source for one in chosen.values()}
    chosen = {column: one for column, one in chosen.items() if one.source or one.every}
    loose = [one for one in proposals.get(ANGLE, ()) if one.source not in taken]
    if loose and not any(name in chosen for name in ENCODERS):
        if ask:
            shaft = _one_of(ask, f'Is {loose[0].source!r} the angle of the motor or of the load',
                            ['motor', 'load'])
            chosen[f'{shaft}_position'] = Proposal(f'{shaft}_position', loose[0].source,
                                                   loose[0].unit)
        else:
            others = [one.source for one in loose[1:]]
            first = replace(loose[0], column=ENCODERS[0])
            unit = '' if not _refused(ENCODERS[0], first) and (first.unit or si) else ':UNIT'
            missing.append(f'--column {shlex.quote(f"motor_position={first.source}{unit}")} '
                           f'(or load_position{f"; or of {others}" if others else ""})')
    for names in (('t',), ENCODERS):
        if any(name in chosen or not ask and proposals.get(name) for name in names) or (
                not ask and loose and names is ENCODERS):
            continue
        if ask:
            name = names[-1]
            chosen[name] = Proposal(name, _one_of(ask, f'Which is {name}', list(of.sources)), '')
        else:
            meant = [said for name, said in of.refused.items()
                     if looks_like(name) in (*names, ANGLE)]
            free = [one for one in of.sources if one not in taken]
            if names == ('t',):
                free = [one for one in free if rises(of.numbers.get(one))] or free
            else:
                free = [one for one in free if may_be_angle(one, of.units.get(one, ''))]
            if not free and not meant:
                missing.append(f'{" or ".join(names)}, which no column of {of.path} holds')
                continue
            missing.append(f'--column {names[0]}=SOURCE (of {free[:12]}'
                           + ''.join(f'; {one}' for one in meant)
                           + ('; or count the rows in their period: t=:2 ms'
                              if names == ('t',) and not of.messages else '') + ')')
    for column, one in chosen.items():
        refused = _refused(column, one)
        if one.unit and not refused:
            continue
        if si and not refused:
            chosen[column] = replace(one, unit=_usual(one, linear))
        elif ask:
            question = f'In which unit is {one.source!r} ({column})'
            # of a unit that cannot be, as counts, nothing else stands to reason
            usual = '' if refused else _usual(one, linear)
            unit = _until(ask, f'{refused}\n{question}' if refused else question, usual,
                          lambda text, column=column: _judge_answer(column, text))
            chosen[column] = replace(one, unit=unit)
        else:
            missing.append(f'--column {shlex.quote(f"{column}={one.source}:UNIT")} ' + (
                f'({refused})' if refused else '(or --si for all)') + (
                    '' if column in ('t', 'voltage', 'current', *ENCODERS) else
                    f', or --column {column}= without it'))
    return {name: chosen[name] for name in NAMES if name in chosen}, missing


def not_asked_for(of: Offered) -> list[str]:
    """Return why columns cannot be read whose names are those of no column that is needed."""
    beside = [said for name, said in of.refused.items()
              if looks_like(name) not in ('t', *ENCODERS, ANGLE)]
    more = len(beside) - SHOWN
    return beside[:SHOWN] + ([f'and {more} columns more'] if more > 0 else [])


def _joints(sources: Sequence[str]) -> list[str]:
    """Return the names by which sources differ where nothing else tells them apart, else []."""
    parted = [re.fullmatch(r'(.*?)\[([^\[\]]+)\](.*)', one) for one in sources]
    around = {(one[1], one[3]) for one in parted if one}
    named = [one[2] for one in parted if one and not one[2].isdigit()]
    return named if len(around) == 1 and len(named) == len(sources) else []


def _usual(one: Proposal, linear: bool) -> str:
    """Return the SI unit that a column has where nothing else is said."""
    if one.shaft:
        return 'N m'
    straight = linear and not one.column.startswith('motor_')
    return straightened(UNIT[one.column]) if straight else UNIT[one.column]


def _refused(column: str, one: Proposal) -> str:
    """Say why a unit cannot be that of a column; '' where it can."""
    if not one.unit and column in COMMANDS and is_share(one.source):
        return ('it is a share of the supply: give what 1 of it is, 24 V of a duty, 24/255 V of '
                'counts up to 255')
    try:
        judge_unit(repr(one.source), column, one.unit)
    except ValueError as problem:
        return str(problem)
    return ''


def complete(machine: Machine, columns: Mapping[str, Proposal], ask: Ask | None) -> list[str]:
    """Complete parts and values by questions; return the flags that are missing without them."""
    missing = []
    both = all(name in columns for name in ENCODERS)
    for section, choices in (('drive', SECTIONS['drive']), ('mechanism', SECTIONS['mechanism'])):
        if section in machine.parts:
            continue
        if section == 'mechanism' and not both:
            machine.choose('mechanism', 'rigid', 'one encoder does not show what bends')
        elif ask:
            told = '; '.join(f'{name}: {ABOUT[name]}' for name in choices)
            machine.parts[section] = _one_of(ask, f'{section} ({told})', list(choices))
        else:
            missing.append(f'--{section} (of {list(choices)})')
    if 'controller' not in machine.parts:
        machine.choose('controller', 'none', 'nothing was said of one')
    machine.parts = {section: machine.parts[section] for section in SECTIONS
                     if section in machine.parts}
    for path in machine.needed():
        parameter, unit = machine.declared()[path]
        if ask:
            _until(ask, f'{path} [{unit or "a number"}]: {parameter.meaning} Such as '
                   f'{example(unit, path)}', '',
                   lambda text, path=path: machine.give(path, text))
        else:
            missing.append(f"{flag(path)} '{example(unit, path)}'")
    return missing


def with_command(machine: Machine, columns: Mapping[str, Proposal]) -> dict[str, Proposal]:
    """
    Return the columns with the set-point of the current as the command, where it is that.

    A drive of 1 A for one unit of command was told a current: its command is the set-point.
    """
    told = columns.get('current_reference')
    drive = machine.declared().get('drive.gain')
    if 'voltage' in columns or told is None or drive is None or drive[1] != 'A/V' or (
            machine.values().get('drive.gain') != 1.0):
        return dict(columns)
    given = {**columns, 'voltage': Proposal('voltage', told.source, told.unit)}
    return {name: given[name] for name in NAMES if name in given}


def _one_of(ask: Ask, question: str, choices: Sequence[str], usual: str | None = None) -> str:
    """Ask for one of some choices; Enter stands for ``usual``, or for the first of them."""
    def judge(text: str) -> None:
        if text not in choices:
            raise ValueError(or_what(text, choices))
    listed = ', '.join(choices[:12])
    return _until(ask, f'{question} ({listed})', choices[0] if usual is None else usual, judge)


def _judge_answer(column: str, unit: str) -> None:
    if not unit:
        raise ValueError(f'a unit is needed, such as {UNIT[column]}')
    judge_unit('the unit', column, unit)


def _until(ask: Ask, question: str, default: str, judge: Callable[[str], object]) -> str:
    """Ask until the answer is judged well, with what was wrong with the last one."""
    asked = question
    while True:
        answer = ask(asked, default).strip() or default
        try:
            judge(answer)
        except ValueError as problem:
            asked = f'{problem}\n{question}'
        else:
            return answer
