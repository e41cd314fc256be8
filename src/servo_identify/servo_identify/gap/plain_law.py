"""
What a plain law, in proportion to one variable, would explain in the place of a cause.

Laws with shapes have simpler ones as their limits: bristles without length are a level of
friction, a saturation from the first ampere on is another torque constant. Where such a limit does
as much, the recordings show nothing of the law itself, and it is not known to be there.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .ambiguity import taken_from
from .balance import BALANCES
from .comparison import complexity
from .screening import Screening
from .stack import Stack

AT_A_SHAFT = {'direction': 'direction', 'speed': 'load_speed', 'acceleration': 'load_acceleration'}
PLAIN = {'motor': {**AT_A_SHAFT, 'current': 'current'}, 'load': AT_A_SHAFT,
         'torque': {**AT_A_SHAFT, 'current': 'current'}, 'transmission': {'torque': 'torque'}}
"""By balance the variables, and columns of the motion, of laws that any servo file has there."""
NO_MORE = (0.1, 0.15)  # share and squares of the scale by which one that does as much leaves more
BETTER = 0.5  # share of what a cause leaves that a plain law does not, where it is no simpler
KEPT = 0.1  # share of its gain that a cause must keep beside a law that nobody named


def plainly_outdone_by(screening: Screening, chosen: list[int], one: int) -> str:
    """
    Return the variable of a plain law that makes a chosen cause needless, '' where there is none.

    The law has one number: it outdoes a cause that has more when it leaves no more, and one that
    has no more when it leaves half. Nor may the cause have much to do beside it. A value that is
    off is as plain a law itself.
    """
    if screening.library.candidates[one].effect is None:
        return ''
    rest = [c for c in chosen if c != one]
    last = screening.loss(chosen)
    least = KEPT * (screening.loss(rest) - last)
    richer = complexity(screening, one) > 1
    for balance in taken_from(screening, rest, chosen):
        left, rows = _left(screening, balance, chosen)
        times, more = NO_MORE
        most = last + times * left + more * rows if richer else last - BETTER * left - more * rows
        for variable, table in _plain_laws(screening.stack, balance):
            with_law = screening.loss_beside(rest, table)
            if with_law < most and with_law - screening.loss_beside(chosen, table) < least:
                return variable
    return ''


def _left(screening: Screening, balance: str, chosen: list[int]) -> tuple[float, float]:
    """Return what some causes leave of a balance and the number of its rows, both as weighed."""
    rows = screening.stack.balance == BALANCES.index(balance)
    weight = screening.weight[rows]**2
    return float(weight @ screening.residual(chosen)[rows]**2), float(weight.sum())


def _plain_laws(stack: Stack, balance: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield (variable, the change of all rows by a law in proportion to it, (rows, 1))."""
    for variable, name in PLAIN.get(balance, {}).items():
        values = stack.at_rows(balance, lambda one, name=name: one.weighed(name, balance))
        yield variable, stack.columns_of(balance, values[:, None])
