"""What init must know, by flags or by questions: columns, parts, values with their units."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from functools import partial
import shlex

import numpy as np

from servo_twin.physics.straight_units import straightened

from ..data.column_names import ANGLE, is_share, looks_like, NAMES
from ..data.column_units import COMMANDS, UNIT
from ..data.finding import SHOWN
from .given_columns import judge_unit
from .hints import counts_rows, doubt_of, in_volts, without_angle
from .machine import ABOUT, example, flag, Machine, SECTIONS
from .proposals import may_be_angle, Proposal, rises
from .questions import Ask, one_of, until
from .sources import Offered
from .torques import choose_torques

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
            answer = one_of(ask, f'Which is {column}', [one.source for one in several])
            chosen[column] = next((one for one in several if one.source == answer),
                                  Proposal(column, answer, ''))
        else:
            unit = '' if all(one.unit for one in several) or si else ':UNIT'
            missing.append(f'--column {column}=SOURCE{unit} '
                           f'(of {[one.source for one in several]})'
                           + _or_without(column))
        taken |= {chosen[column].source} if column in chosen else set()
    pick = partial(one_of, ask, usual='') if ask else None
    chosen, untold = choose_torques(of, proposals, chosen, pick)
    missing += untold
    if not {'voltage', 'current_reference'} & chosen.keys() and not any(
            'voltage=' in one for one in untold):
        missing += _choose_command(of, chosen, ask)
    taken |= {one.source for one in chosen.values()}
    chosen = {column: one for column, one in chosen.items() if one.source or one.every}
    loose = [one for one in proposals.get(ANGLE, ()) if one.source not in taken]
    if loose and not any(name in chosen for name in ENCODERS):
        if ask:
            shaft = one_of(ask, f'Is {loose[0].source!r} the angle of the motor or of the load',
                            ['motor', 'load'])
            chosen[f'{shaft}_position'] = Proposal(f'{shaft}_position', loose[0].source,
                                                   loose[0].unit)
        else:
            others = [one.source for one in loose[1:]]
            first = replace(loose[0], column=ENCODERS[0])
            doubt = doubt_of(first.column, first.source)
            unit = '' if not _refused(ENCODERS[0], first) and (first.unit or si) else ':UNIT'
            missing.append(f'--column {shlex.quote(f"motor_position={first.source}{unit}")} '
                           f'(or load_position{f"; or of {others}" if others else ""}'
                           f'{"; both shafts take a --column each" if others else ""}'
                           f'{f"; {doubt}" if doubt else ""})')
    for names in (('t',), ENCODERS):
        if any(name in chosen or not ask and proposals.get(name) for name in names) or (
                not ask and loose and names is ENCODERS):
            continue
        meant = [said for name, said in of.refused.items() if looks_like(name) in (*names, ANGLE)]
        free = _may_be(of, names, taken)
        if ask:
            name = names[-1]
            chosen[name] = Proposal(name, one_of(ask, f'Which is {name}', free or [*of.sources],
                                                  free[0] if len(free) == 1 else ''), '')
        elif not free and not meant:
            missing.append(f'{" or ".join(names)}, which no column of {of.path} holds'
                           + (without_angle(of, taken) if names is ENCODERS else ''))
        else:
            missing.append(f'--column {names[0]}=SOURCE{"" if si else ":UNIT"} (of {free[:12]}'
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
            unit = until(ask, f'{refused}\n{question}' if refused else question, usual,
                          lambda text, column=column: _judge_answer(column, text))
            chosen[column] = replace(one, unit=unit)
        else:
            missing.append(f'--column {shlex.quote(f"{column}={one.source}:UNIT")} ' + (
                f'({refused})' if refused else
                '(its numbers count the rows: say ms where they do, else count them: t=:2 ms)'
                if column == 't' and counts_rows(of.numbers.get(one.source)) else
                '(or --si for all)')
                + _or_without(column, _goes_without(column, one, chosen)))
    return {name: chosen[name] for name in NAMES if name in chosen}, missing


def _choose_command(of: Offered, chosen: dict[str, Proposal], ask: Ask | None) -> list[str]:
    """Choose the command among channels in volts; return the flag that chooses it, if missing."""
    volts = in_volts(of, {one.source for one in chosen.values()})
    if volts and ask:
        source = one_of(ask, 'Which is the command that the drive received',
                        [*volts, 'none of them'], '')
        if source in volts:
            chosen['voltage'] = Proposal('voltage', source, of.units[source])
    if not volts or ask:
        return []
    others = f' (or of {volts[1:]})' if volts[1:] else ''
    return [f'--column {shlex.quote(f"voltage={volts[0]}")} where that is the command that the '
            f'drive received{others}, or --column voltage= without it']


def not_asked_for(of: Offered) -> list[str]:
    """Return why columns cannot be read whose names are those of no column that is needed."""
    beside = [said for name, said in of.refused.items()
              if looks_like(name) not in ('t', *ENCODERS, ANGLE)]
    more = len(beside) - SHOWN
    return beside[:SHOWN] + ([f'and {more} columns more'] if more > 0 else [])


def _or_without(column: str, spare: bool = False) -> str:
    """Say how a column is left out that is ``spare``, or no part of every diagnosis."""
    needed = column in ('t', 'voltage', 'current', *ENCODERS) and not spare
    return '' if needed else f', or --column {column}= without it'


def _goes_without(column: str, one: Proposal, chosen: Container[str]) -> bool:
    """Tell whether a command is a share of the supply beside a current, which may drive alone."""
    return column == 'voltage' and is_share(one.source) and (
        'current' in chosen or 'current_reference' in chosen)


def _may_be(of: Offered, names: Sequence[str], taken: Container[str]) -> list[str]:
    """Return the sources that nothing speaks against for the time, or for an angle."""
    free = [one for one in of.sources if one not in taken]
    if names == ('t',):
        return [one for one in free if rises(of.numbers.get(one))] or free
    return [one for one in free if may_be_angle(one, of.units.get(one, ''))
            and not _stands(of.numbers.get(one)) and not counts_rows(of.numbers.get(one))]


def _stands(numbers: np.ndarray | None) -> bool:
    """Tell whether all numbers are one, as of a state that did not change."""
    return numbers is not None and not np.nanmax(np.abs(np.diff(numbers)), initial=0.0) > 0.0


def _usual(one: Proposal, linear: bool) -> str:
    """Return the SI unit that a column has where nothing else is said."""
    if one.shaft:
        return 'N m'
    straight = linear and not one.column.startswith('motor_')
    return straightened(UNIT[one.column]) if straight else UNIT[one.column]


def _refused(column: str, one: Proposal) -> str:
    """Say why a unit cannot be that of a column; '' where it can."""
    if column in COMMANDS and is_share(one.source) and one.unit in ('', '%', 'percent'):
        return ('it is a share of the supply: give what 1 of it is, ' + (
            '0.24 V of a % at 24 V' if one.unit else '24 V of a duty, 24/255 V of counts up to '
            '255'))
    if not one.unit and (doubt := doubt_of(column, one.source)):
        return doubt
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
            machine.parts[section] = one_of(ask, f'{section} ({told})', list(choices))
        else:
            missing.append(_each_with_values(machine, section, choices))
    if 'controller' not in machine.parts:
        machine.choose('controller', 'none', 'nothing was said of one')
    machine.parts = {section: machine.parts[section] for section in SECTIONS
                     if section in machine.parts}
    for path in machine.needed():
        parameter, unit = machine.declared()[path]
        if ask:
            until(ask, f'{path} [{unit or "a number"}]: {parameter.meaning} Such as '
                   f'{example(unit, path)}', '',
                   lambda text, path=path: machine.give(path, text))
        else:
            missing.append(f"{flag(path)} '{example(unit, path)}'")
    return missing


def _each_with_values(machine: Machine, section: str, choices: Mapping[str, object]) -> str:
    """Return the flags of a part that is missing, one type after the other with its values."""
    told = []
    for kind in choices:
        one = replace(machine, parts={**machine.parts, section: kind})
        values = one.flags_needed(section)
        told.append(' '.join([f'--{section} {kind}', *values]))
    return '\n    or '.join(told)


def _judge_answer(column: str, unit: str) -> None:
    if not unit:
        raise ValueError(f'a unit is needed, such as {UNIT[column]}')
    judge_unit('the unit', column, unit)
