"""What columns seem to be that can be no column of a recording as they are, and what helps."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from itertools import combinations
import re

import numpy as np

from ..data.column_names import (
    ANGLE,
    is_effective,
    is_electrical,
    is_no_angle,
    is_speed,
    looks_like,
    split,
)
from ..data.column_units import COMMANDS, CURRENTS, EFFECTIVE
from .joints import are_phases
from .sources import Offered

_ANGLES = ('motor_position', 'load_position', 'reference_position')
VOLTS = ('V', 'mV', 'volt', 'volts', 'Volt', 'Volts')


def counts_rows(times: np.ndarray | None) -> bool:
    """Tell whether times rise by 1 from row to row: of ms at 1 kHz, or a number of each row."""
    return times is not None and len(times) > 1 and bool(np.all(np.diff(times) == 1.0))


def doubt_of(column: str, source: str) -> str:
    """Return why the name of a source puts its unit in doubt; '' where it does not."""
    if column in (*CURRENTS, *COMMANDS) and is_effective(source):
        return EFFECTIVE
    if column in (ANGLE, *_ANGLES) and is_electrical(source):
        return ('it is an electrical angle: give what 1 rad of it is of the motor, 1/7 rad at 7 '
                'pole pairs')
    return ''


def in_volts(of: Offered, taken: Container[str]) -> list[str]:
    """Return the sources in volts of which nothing else is known, as the channels of a scope."""
    return [one for one, unit in of.units.items() if one not in taken and not looks_like(one)
            and unit in VOLTS and not is_no_angle(one) and not of.messages]


def without_angle(of: Offered, taken: Container[str]) -> str:
    """Return what helps where nothing is an angle: a sensor in volts, a speed; '' for neither."""
    free = [one for one in of.sources if one not in taken]
    volts = next((one for one in reversed(free) if of.units.get(one) in VOLTS), '')
    if volts:
        return (f"; an angle sensor in V is given with what 1 V of it is: --column "
                f"'load_position={volts}:0.3 rad'")
    speed = next((one for one in free if is_speed(one)), '')
    return (f'; {speed!r} is a speed: add a column with its integral, as by '
            'scipy.integrate.cumulative_trapezoid(speed, t, initial=0)') if speed else ''


def phases(sources: Sequence[str]) -> list[str]:
    """Return what is said of sources that are the three phases of a motor."""
    names = {one: split(one)[0] for one in sources}
    found = list[str]()
    for three in _threes(names):
        found.append(f'{", ".join(map(repr, three))} look like the phases of a motor: none of '
                     'them is its current or its command. Log i_q and u_q, or make them by the '
                     'electrical angle (transformation of Park)')
    return found


def _threes(names: dict[str, str]) -> Iterable[tuple[str, ...]]:
    """Yield three sources each that differ by the letter of a phase alone."""
    shapes: dict[str, list[str]] = {}
    for source, name in names.items():
        for at in re.finditer('[a-cu-wA-CU-W]', name):
            before, behind = name[:at.start()], name[at.end():]
            if looks_like(before.rstrip('_') + behind) in ('current', 'voltage'):
                shapes.setdefault(f'{before}*{behind}', []).append(source)
    for shape, several in shapes.items():
        letters = {one: names[one][shape.index('*')].lower() for one in several}
        for three in combinations(several, 3):
            if are_phases([letters[one] for one in three]):
                yield three
