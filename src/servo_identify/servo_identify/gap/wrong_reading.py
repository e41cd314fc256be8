"""
Whether one sensor reads wrong, where two balances depart that its reading enters.

With that reading eliminated from the two, a parity relation of structured residuals, its error is
gone; what truly acts on two parts of a machine has no reason to cancel.
"""

from __future__ import annotations

import numpy as np

from .screening import Screening
from .stack import NOTICED

ENTERS = {'torque': ('motor', 'load', 'transmission'), 'current': ('drive', 'motor')}
CANCELS = 0.3  # share of the larger square that two departures may leave in their sum


def wrong_reading(screening: Screening, kept: list[int]) -> str:
    """
    Return the channel ('torque' or 'current') whose reading would be all that departs, '' if none.

    ``kept`` are the causes found; one that corrects a reading already leaves nothing to say.
    """
    stack = screening.stack
    if any(screening.library.candidates[one].site in ENTERS for one in kept):
        return ''
    used, fitted = screening.coefficients(kept)
    causes = used >= len(screening.nuisance)
    departure = (screening.residual(kept, held_out=False)
                 - screening.columns(used[causes]) @ fitted[causes])
    values = stack.extended.servo.values
    # an error e of the torque adds -e / ratio at the motor and e at the load; one of the current
    # adds e at the drive and gain * e at the motor
    for channel, gain in (('torque', values['mechanism.ratio']),
                          ('current', -values['drive.torque_constant'])):
        first, second = _at_once(screening, departure, *ENTERS[channel][:2])
        if first.size and np.mean((gain * first + second)**2) < CANCELS * max(
                np.mean((gain * first)**2), np.mean(second**2)):
            return channel
    return ''


def _at_once(screening: Screening, departure: np.ndarray, first: str,
             second: str) -> tuple[np.ndarray, np.ndarray]:
    """Return what departs in two balances at the instants of the second, empty if not in both."""
    stack = screening.stack
    pairs, squares = [], []
    for number, one in enumerate(stack.balances):
        if not {first, second} <= set(one.names):
            continue
        x, y = (stack.series(number, name, departure) for name in (first, second))
        if not (np.isfinite(x).any() and np.isfinite(y).any()):
            continue
        squares.append((np.nanmean(x**2), np.nanmean(y**2)))
        x, y = (stack.series(number, name, departure * stack.scale) for name in (first, second))
        there = np.isfinite(x)
        x = np.interp(one.times(second), one.times(first)[there], x[there])
        pairs.append((x[np.isfinite(y)], y[np.isfinite(y)]))
    if not pairs or np.min(np.mean(squares, axis=0)) < NOTICED:
        return np.zeros(0), np.zeros(0)
    x, y = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    return x, y
