"""
Whether one sensor reads wrong, where two balances depart that its reading enters.

With that reading eliminated from the two, a parity relation of structured residuals, its error is
gone; what truly acts on two parts of a machine has no reason to cancel.
"""

from __future__ import annotations

import numpy as np

from .balance import BALANCES
from .regression import less
from .screening import Screening
from .stack import NOTICED, Stack

ENTERS = {'torque': ('motor', 'load', 'transmission'), 'current': ('drive', 'motor')}
CANCELS = 0.08  # share of the larger square that two departures may leave in their sum


def wrong_reading(screening: Screening, kept: list[int]) -> str:
    """
    Return the channel ('torque' or 'current') whose reading would be all that departs, '' if none.

    ``kept`` are the causes found; one that corrects a reading already leaves nothing to say.
    """
    stack = screening.stack
    if any(screening.library.candidates[one].site in ENTERS for one in kept):
        return ''
    values = stack.extended.servo.values
    # an error e of the torque adds -e / ratio at the motor and e at the load; one of the current
    # adds e at the drive and gain * e at the motor
    for channel, gain in (('torque', values['mechanism.ratio']),
                          ('current', -values['drive.torque_constant'])):
        if _cancels(screening, gain, *ENTERS[channel][:2]):
            return channel
    return ''


def _cancels(screening: Screening, gain: float, first: str, second: str) -> bool:
    """
    Tell whether what departs in two balances is gone from ``gain * first + second``.

    Values within tolerance are fitted to that sum alone: in the two balances they would give way
    to the reading, and hide a part of its error in one of them.
    """
    stack, departure = screening.stack, screening.residual([], held_out=False)
    for name in (first, second):
        rows = stack.balance == BALANCES.index(name)
        if not rows.any() or np.mean(departure[rows]**2) < NOTICED:
            return False
    x, y = _at_once(stack, departure, first, second)
    if not x.size:
        return False
    base, *within = (gain * one + other for one, other in (
        _at_once(stack, column, first, second)
        for column in (stack.base, *screening.columns(screening.nuisance).T)))
    table = np.array(within).reshape(-1, len(base)).T
    moves = np.abs(table).max(axis=0, initial=0.0) > 0.0
    left = less(base, table[:, moves], screening.low[screening.nuisance][moves],
                screening.high[screening.nuisance][moves])
    return np.mean(left**2) < CANCELS * max(np.mean((gain * x)**2), np.mean(y**2))


def _at_once(stack: Stack, residual: np.ndarray, first: str,
             second: str) -> tuple[np.ndarray, np.ndarray]:
    """Return a residual in two balances, in their units, at the instants that both have."""
    pairs = []
    for number, one in enumerate(stack.balances):
        if not {first, second} <= set(one.names):
            continue
        x, y = (stack.series(number, name, residual * stack.scale) for name in (first, second))
        there, asked = np.isfinite(x), np.isfinite(y)
        if there.any():
            x = np.interp(one.times(second)[asked], one.times(first)[there], x[there])
            pairs.append((x, y[asked]))
    if not pairs:
        return np.zeros(0), np.zeros(0)
    x, y = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    return x, y
