"""Which source of a file is probably which column, and in which unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import re

import numpy as np

from ..data.column_names import (
    ANGLE,
    is_no_angle,
    likely,
    looks_like,
    NAMES,
    SPEED,
    split,
    TIMES,
    TOLD_TORQUE,
    TORQUE,
)
from ..data.column_units import factor_of, UNIT
from ..data.physical_units import without_case
from ..data.time_units import unit_of_stamps, unit_of_times
from ..data.unit_symbols import parsed
from .hints import counts_rows, doubt_of
from .joints import joints_of, of_joint
from .sources import Offered

_NO_ANGLES = ('reference_velocity', 'torque', 'current', 'voltage', 'temperature')
_LIKE = {ANGLE: 'load_position', TORQUE: 'torque', TOLD_TORQUE: 'torque'}
"""A column in the unit of what a name says without saying which column it is."""
_COUNTERS = {'millis': 'ms', 'micros': 'us'}
"""How programs of Arduino call their time, and its unit."""


@dataclass(frozen=True)
class Proposal:
    """
    A source for a column; ``unit`` is '' where nothing says which it is.

    ``wraps``: the round in this unit by which the source wraps around; 0 where it does not.
    ``signed``: the bits of its signed numbers, which were read as unsigned; 0 where they were not.
    ``shaft`` is 'motor' or 'load' for a torque that stands for amperes and is counted there;
    it is multiplied by ``scale`` and ``was`` in another unit. ``negate`` turns the sign.
    ``every``, s, counts the rows of a file that has no ``source`` of the time.
    """

    column: str
    source: str
    unit: str
    wraps: float = 0.0
    signed: int = 0
    shaft: str = ''
    scale: float = 1.0
    was: str = ''
    negate: bool = False
    every: float = 0.0


def proposed(of: Offered, joint: str = '') -> dict[str, list[Proposal]]:
    """
    Return proposals for each column, best first; under :data:`ANGLE` those of unknown shaft.

    With a ``joint``, sources that name another one are left out.
    """
    if joint:
        joints = joints_of(([one.source for one in several] for several in proposed(of).values()),
                           of.messages)
        return _proposed(of, of_joint(of.sources, joint, of.messages, joints))
    return _proposed(of, of.sources)


def _proposed(of: Offered, sources: Sequence[str]) -> dict[str, list[Proposal]]:
    """Return the proposals among some sources."""
    found: dict[str, list[Proposal]] = {}
    for source in sources:
        column = looks_like(source, of.kinds.get(source, ''))
        if column:
            found.setdefault(column, []).append(
                Proposal(column, source, unit_said(of, column, source)))
    if not of.messages:
        _part_from_temperatures(found, of)
        found['t'] = _each_once(found.get('t', []) or _by_unit(of, sources), of)
    for column, several in found.items():
        exact = [one for one in several if split(one.source)[0] == column]
        found[column] = exact or several
    if of.messages:
        found['t'] = _time_of_messages(of, found)
    return found


def unit_said(of: Offered, column: str, source: str) -> str:
    """Return the unit of a source that header, name or size of its numbers say; '' for none."""
    if doubt_of(column, source):
        return ''
    unit = of.units.get(source) or _unit_behind(source, column)
    if column == 't' and not unit:
        word = split(source)[0].lower()
        unit = (unit_of_stamps(of.firsts.get(source, 0.0)) or _COUNTERS.get(word, '')
                or looks_like(source) == 't' and unit_of_time(of.numbers.get(source)) or '')
    return unit or (UNIT[column] if source in NAMES else '')


def _by_unit(of: Offered, sources: Sequence[str]) -> list[Proposal]:
    """Return the sources that rise and have a unit of time, whatever their names."""
    return [Proposal('t', one, of.units[one]) for one in sources if one in of.units and _is_unit(
        't', of.units[one]) and rises(of.numbers.get(one))][:1]


def _part_from_temperatures(found: dict[str, list[Proposal]], of: Offered) -> None:
    """Take out of the times what begins with T and does not rise: T_housing_C is a temperature."""
    times = found.get('t', [])
    rising = [one for one in times if rises(of.numbers.get(one.source))]
    for one in times if times != rising else ():
        unit = of.units.get(one.source) or _unit_behind(one.source, 'temperature')
        warm = one not in rising and bool(unit) and _is_unit('temperature', unit)
        if warm:
            found.setdefault('temperature', []).append(Proposal('temperature', one.source, unit))
        if warm or rising and one not in rising:
            found['t'] = [other for other in found['t'] if other is not one]


def _each_once(times: list[Proposal], of: Offered) -> list[Proposal]:
    """Return times without those that go on as another one does, as receipt and header do."""
    kept: list[Proposal] = []
    for one in times:
        steps = np.diff(of.numbers[one.source])
        if not any(np.allclose(steps, np.diff(of.numbers[other.source]), 1e-6, 0.0)
                   for other in kept):
            kept.append(one)
    return kept


def rises(times: np.ndarray | None) -> bool:
    """Tell whether numbers never fall, and rise in most rows."""
    if times is None or len(times) < 2:
        return False
    steps = np.diff(times)
    if not np.isfinite(steps).any():
        return False
    return bool(np.nanmin(steps) >= 0.0 and np.mean(steps > 0.0) > 0.5)


def may_be_angle(source: str, unit: str) -> bool:
    """Tell whether nothing says that a source is another quantity than an angle."""
    named = looks_like(source) in ('', ANGLE, 'motor_position', 'load_position')
    other = any(unit and _is_unit(column, unit) for column in _NO_ANGLES)
    return named and not other and not is_no_angle(source)


def _is_unit(column: str, unit: str) -> bool:
    try:
        factor_of(unit, column, unit, None)
        if column != 'temperature':  # no symbol of physics; others are spelled with their capitals
            parsed(unit)
    except ValueError:
        return False
    return True


def _unit_behind(source: str, column: str) -> str:
    """
    Return the unit that a name holds: current_mA, I/mA, I, mA, current in mA, rpm_set; else ''.

    That is its last word, or the word that says which quantity it is.
    """
    label = re.fullmatch(r'.*\[(.*)\]\.values', source)  # of a list of signals of Simulink
    words = re.split(r'[_/,]\s*|\s+in\s+', label[1] if label else source)
    last = [] if words[-1].isdigit() or len(words) == 1 else words[-1:]  # the number of a joint
    for word in [*last, *(word for word in words[:-1] if word.lower() in SPEED)]:
        unit = without_case(word, source)
        if _is_unit(_LIKE.get(column, column), unit):
            return unit
    return ''


def _time_of_messages(of: Offered, found: dict[str, list[Proposal]]) -> list[Proposal]:
    """Return the stamp of the topic that the encoder is on."""
    for column in ('motor_position', 'load_position', ANGLE):
        for one in found.get(column, ()):
            topic = max((source[:-len('.stamp')] for source in of.sources
                         if source.endswith('.stamp')
                         and one.source.startswith(source[:-len('.stamp')])), key=len)
            return [Proposal('t', f'{topic}.stamp', 's')]
    return []


def unit_of_time(times: np.ndarray | None) -> str:
    """Return the unit in which times make a period of a servo, or ''."""
    if times is None or np.isfinite(times).sum() < 2 or counts_rows(times):
        return ''
    return unit_of_times(float(np.nanmedian(np.abs(np.diff(times)))), float(times[0]))


def doubt_of_time(of: Offered, time: Proposal) -> str:
    """Say, behind a sentence, that its size alone told the unit of a time; '' where not."""
    said = (of.units.get(time.source) or _unit_behind(time.source, 't')
            or unit_of_stamps(of.firsts.get(time.source, 0.0)))
    guessed = time.unit == unit_of_time(of.numbers.get(time.source))
    if said or time.unit in ('', 's') or not guessed:
        return ''
    return (f"; the time was taken in {time.unit} by its size alone: --column 't={time.source}:"
            f"0.1 {time.unit}' says another unit, as of ticks")


def sampled_less_often(of: Offered, chosen: Mapping[str, Proposal]) -> list[str]:
    """Return the columns of a table that have a number in each second row or fewer."""
    known = {column: np.flatnonzero(np.isfinite(of.numbers[one.source]))
             for column, one in chosen.items() if one.source in of.numbers}
    return [column for column, rows in known.items() if len(rows) > 1 and
            np.median(np.diff(rows)) > 1.0]


def needs_mapping(of: Offered, chosen: Mapping[str, Proposal]) -> bool:
    """Return whether the chosen columns can be read by a mapping file only, not by their names."""
    if of.messages or of.names or of.rows or sampled_less_often(of, chosen):
        return True
    for column, one in chosen.items():
        if one.wraps or one.signed or one.was or one.negate or one.every:
            return True
        name, unit = split(one.source)
        if name != column and not (column == 't' and name.lower() in TIMES):
            return True
        if one.unit not in (unit, '' if unit else UNIT[column]):
            return True
    missing = [name for name in NAMES if name not in chosen]
    taken = {one.source for one in chosen.values()}
    return any(split(source)[0] in NAMES or likely(split(source)[0], missing)
               for source in of.sources if source not in taken)
