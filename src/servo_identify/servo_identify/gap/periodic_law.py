"""
What another law of the same orders would explain in the place of a periodic cause.

Friction that varies over the turn, cogging and a ripple of the torque repeat themselves alike;
what they are multiplied by tells them apart: the way a shaft turns, nothing, the current. Where
the orders times another variable explain more, and leave the cause nothing to do, it is not what
acts.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .ambiguity import taken_from
from .completeness import ANGLES
from .plain_law import AT_A_SHAFT, KEPT
from .screening import Screening
from .shape_values import periodic_in
from .stack import Stack

MORE = 1.05  # times a cause's gain that another law with as many numbers must take away
TIMES = {**AT_A_SHAFT, 'current': 'current', 'torque': 'torque'}
"""By variable the column of the motion by which waves are multiplied."""


def periodically_outdone_by(screening: Screening, chosen: list[int],
                            one: int) -> tuple[str, ...]:
    """
    Return the variables of a law that makes a chosen periodic cause needless, () without one.

    The other law has the cause's orders and as many numbers, so that it outdoes the cause by what
    it is multiplied by and not by being richer.
    """
    candidate = screening.library.candidates[one]
    if not candidate.order:
        return ()
    rest = [c for c in chosen if c != one]
    without, last = screening.loss(rest), screening.loss(chosen)
    _, angle = periodic_in(candidate.effect, candidate.site, screening.stack)
    multiples = max(1, len(screening.members[one]) // 2)
    better: list[tuple[float, tuple[str, ...]]] = []
    for balance in taken_from(screening, rest, chosen):
        for times, table in _laws(screening.stack, balance, angle,
                                  candidate.order * np.arange(1, multiples + 1)):
            left = screening.loss_beside(rest, table)
            beside = left - screening.loss_beside(chosen, table)
            if without - left > MORE * (without - last) and beside < KEPT * (without - last):
                better.append((left, (ANGLES[angle], *times)))
    return min(better, default=(0.0, ()))[1]


def _laws(stack: Stack, balance: str, angle: str,
          orders: np.ndarray) -> Iterator[tuple[tuple[str, ...], np.ndarray]]:
    """Yield (what waves are multiplied by, the change of all rows by them, (rows, waves))."""
    def of(one):
        phase = orders * one.series(angle, balance)[:, None]
        waves = np.hstack((np.cos(phase), np.sin(phase))).T
        factors = [1.0, *(one.series(column, balance) for column in TIMES.values())]
        return np.column_stack([one.under(wave * factor, one.bump_of(balance))
                                for factor in factors for wave in waves])

    names = [(), *((variable,) for variable in TIMES)]
    tables = np.split(stack.at_rows(balance, of), len(names), axis=1)
    for times, table in zip(names, tables, strict=True):
        yield times, stack.columns_of(balance, table)
