"""
Torques that no sensor measured: computed by a drive from its current, or told to it.

.. math:: i = T / K_t

Robots log an effort in N m where others log a current. Where nobody gives the torque constant, 1 A
stands for 1 N m. A torque that is counted at the load is brought to the motor by the ratio.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isclose
import re

from ..data.column_names import TOLD_TORQUE, TORQUE
from ..data.column_units import COMMANDS, CURRENTS
from ..data.physical_units import factor_to
from ..data.unit_symbols import UnitError
from .machine import Machine, RATIO
from .proposals import Proposal
from .sources import Offered

SAME = 0.01  # share by which a ratio that a unit has may be rounded
CONSTANT, GAIN = 'drive.torque_constant', 'drive.gain'
_SHAFTS = {'motor': 'motor', 'joint': 'load'}


def stands_for_current(column: str, unit: str) -> bool:
    """Tell whether a current or a command is given as a torque."""
    if column not in (*CURRENTS, *COMMANDS) or not unit:
        return False
    try:
        return factor_to(unit, 'N m') > 0.0
    except UnitError:
        return False


def shaft_of(of: Offered, column: str, source: str) -> str:
    """Return 'load' for an effort of a message of joints, which is behind the gear; else ''."""
    joints = 'Joint' in of.kinds.get(source, '').rpartition('/')[2]
    return 'load' if joints and column in (*CURRENTS, *COMMANDS) else ''


def choose_torques(of: Offered, proposals: Mapping[str, Sequence[Proposal]],
                   chosen: Mapping[str, Proposal],
                   ask: Callable[[str, Sequence[str]], str] | None
                   ) -> tuple[dict[str, Proposal], list[str]]:
    """
    Return the columns with torques that stand for command and current; the flags that are missing.

    A torque that was told is asked for where there is no command, one that may be computed where
    there is neither torque nor current. ``ask`` asks for one of some choices, None where
    nothing can be asked.
    """
    taken = {one.source for one in chosen.values()}
    found, missing = dict(chosen), list[str]()
    told, computed = ([one for one in proposals.get(kind, ()) if one.source not in taken]
                      for kind in (TOLD_TORQUE, TORQUE))
    if told and not {'voltage', 'current_reference'} & found.keys():
        if ask:
            one = _one_of(told, 'Which torque is the command', ask)
            answer = ask(f'Is {one.source!r} the command that the drive received, counted at the '
                         'motor or at the joint', [*_SHAFTS, 'leave out'])
            if answer in _SHAFTS:
                found['voltage'] = replace(one, column='voltage', shaft=_SHAFTS[answer])
        else:
            missing.append(f'{_flags(of, "voltage", told)} (the command), or --column voltage= '
                           'without it')
    if computed and not {'torque', 'current'} & found.keys():
        if ask:
            one = _one_of(computed, 'Which torque is that of this machine', ask)
            answer = ask(f'Was {one.source!r} measured by a torque sensor, or does the drive '
                         'compute it, counted at the motor or at the joint',
                         ['sensor', *_SHAFTS, 'leave out'])
            if answer in _SHAFTS:
                found['current'] = replace(one, column='current', shaft=_SHAFTS[answer])
            elif answer == 'sensor':
                found['torque'] = replace(one, column='torque')
        else:
            one = computed[0]
            missing.append(f'{_flags(of, "current", computed)} where the drive computes it from '
                           f"its current, or --column 'torque={one.source}:{_unit_of(one)}' "
                           'where a sensor measured it, or --column current= without it')
    said = {one.unit for one in (*told, *computed) if _unit_of(one) == 'UNIT'}
    missing += [f'    UNIT is what 1 {unit} of that torque is, such as 0.0127 N m'
                for unit in said if any(':UNIT' in one for one in missing)]
    return found, missing


def _unit_of(one: Proposal) -> str:
    """Return the unit in which a torque is given: its own, where that is one of torques."""
    if not one.unit:
        return 'N m'
    return one.unit if stands_for_current('current', one.unit) else 'UNIT'


def _one_of(several: Sequence[Proposal], question: str,
            ask: Callable[[str, Sequence[str]], str]) -> Proposal:
    """Return the one of several that is meant."""
    if len(several) == 1:
        return several[0]
    answer = ask(question, [one.source for one in several])
    return next(one for one in several if one.source == answer)


def _flags(of: Offered, column: str, several: Sequence[Proposal]) -> str:
    """Return the flags that take a torque for a current, of the motor or of the joint."""
    one, *more = several
    unit = _unit_of(one)
    others = f', or of {[other.source for other in more]},' if more else ''
    if shaft_of(of, column, one.source):
        return f"--column '{column}={one.source}:{unit}'{others}"
    return (f"--column '{column}={one.source}:{unit}' of the motor, or "
            f"'{column}={one.source}:1/RATIO {unit}' of the joint{others}")


def complete_drive(machine: Machine, columns: Mapping[str, Proposal]) -> None:
    """Give the drive what follows from torques that stand for its current or its command."""
    torques = {name: one for name, one in columns.items()
               if stands_for_current(name, one.unit)}
    if not torques:
        return
    what = ' and '.join(repr(one.source) for one in torques.values())
    stands = 'stands' if len(torques) == 1 else 'stand'
    if 'drive' not in machine.parts and ('voltage' in torques or 'voltage' not in columns):
        machine.choose('drive', 'current', f'{what} {stands} for its current')
    measured = columns.keys() & {*CURRENTS} - torques.keys()
    for path, text, skip in ((GAIN, '1 A/A', 'voltage' in columns.keys() - torques.keys()),
                             (CONSTANT, '1 N m/A', bool(measured))):
        known = machine.declared().get(path)
        if skip or known is None or path in machine.texts or (
                path == GAIN and known[1] != 'A/V'):
            continue
        machine.give(path, text)
        machine.chosen[path] = f'{text}, as {what} in N m {stands} for the current of the drive'


def as_currents(columns: Mapping[str, Proposal], machine: Machine) -> dict[str, Proposal]:
    """Return the columns with torques divided by the torque constant: amperes."""
    values = machine.values()

    def of(one: Proposal) -> Proposal:
        if not stands_for_current(one.column, one.unit):
            return one
        scale, ratio = factor_to(one.unit, 'N m'), values.get(RATIO, 1.0)
        if one.shaft == 'load' and not _of_motor(one.unit, ratio):
            scale /= ratio
        return replace(one, unit='', scale=scale / values.get(CONSTANT, 1.0), was=one.unit)

    return {name: of(one) for name, one in columns.items()}



def _of_motor(unit: str, ratio: float) -> bool:
    """Tell whether a torque of the joint is divided by the ratio in its unit, 1/RATIO N m."""
    told = re.match(r'1/([\d.]+) ', unit)
    return told is not None and isclose(float(told[1]), ratio, rel_tol=SAME)
