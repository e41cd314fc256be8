"""Numbers as registers hold them: they wrap around, or were read as unsigned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ..data.column_names import is_electrical
from ..data.column_units import factor_of
from ..data.set_clocks import COUNTERS
from ..data.signals import TURN
from ..data.survey import round_of, survey
from ..data.unsigned import bits_of, OTHERS
from .proposals import Proposal
from .sources import Offered

WITHIN = 3.0  # periods, within which a counter goes on where it begins again
NEAR = 0.003  # of a round, within which the one that is meant is taken for it


def with_turns(columns: Mapping[str, Proposal], recording: Recording,
               servo: Servo) -> dict[str, Proposal]:
    """
    Return the columns, with the round of those that jump back by it in this recording.

    An electrical angle has its own, which it passes too often for any other to be told.
    """
    turned = {name: _meant(turn / factor_of(name, name, columns[name].unit, servo), turn == TURN)
              for name, turn in survey(recording, servo).wrapped.items()}
    turned |= {name: turn for name, one in columns.items() if is_electrical(one.source)
               and (turn := _turn_of_field(recording[name] / factor_of(
                   name, name, one.unit, servo)))}
    return {name: replace(one, wraps=turned.get(name, one.wraps)) for name, one in columns.items()}


def with_counter(columns: Mapping[str, Proposal], of: Offered) -> dict[str, Proposal]:
    """Return the columns, with the round of a counter of time that began again from 0."""
    counts = of.numbers.get(columns['t'].source) if 't' in columns else None
    bits = [] if counts is None else [one for one in COUNTERS if _begins_again(counts, one)]
    if not bits:
        return dict(columns)
    return {**columns, 't': replace(columns['t'], wraps=2.0 ** bits[0])}


def _begins_again(counts: np.ndarray, bits: int) -> bool:
    """Tell whether counts begin again behind the last number of so many bits, and rise else."""
    steps = np.diff(counts[np.isfinite(counts)])
    back = np.flatnonzero(steps < 0.0)
    if not len(back):
        return False
    usual = float(np.median(np.abs(steps)))
    return bool(np.all(np.abs(steps[back] + 2.0 ** bits) < WITHIN * usual))


def with_signs(columns: Mapping[str, Proposal], of: Offered) -> dict[str, Proposal]:
    """Return the columns, with the bits of those whose negative numbers were read as unsigned."""
    told = {name: bits_of(of.numbers[one.source]) for name, one in columns.items()
            if name not in OTHERS and one.source in of.numbers}
    return {name: replace(one, signed=told.get(name, 0)) for name, one in columns.items()}


def _turn_of_field(numbers: np.ndarray) -> float:
    """Return the turn, rad or degrees, by which numbers (rows,) jump back; 0 where they do not."""
    known = numbers[np.isfinite(numbers)]
    return next((turn for turn in (TURN, 360.0) if round_of(known * (TURN / turn)) == TURN), 0.0)


def _meant(seen: float, turn: bool) -> float:
    """Return the round that is meant: a turn, a power of two or a number of two digits; else 0."""
    if turn:
        return seen
    near = min(2.0 ** round(np.log2(seen)), float(f'{seen:.1e}'), key=lambda one: abs(one - seen))
    return near if abs(near / seen - 1.0) < NEAR else 0.0
