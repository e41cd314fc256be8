"""How far the gains of a controller are off, found by its law and not by its slope."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from .balance import BALANCES
from .stack import Stack

SLIGHT = 0.01  # of a gain that is right, by which it is moved for its slope to be seen


def gains_off(stack: Stack, paths: tuple[str, ...]) -> np.ndarray:
    """
    Return how far the gains of all recordings are from those of the servo file, in their units.

    Gains that multiply each other, and those that drive the law into its limit, are far from
    linear: taken apart at any other size, what they move does not add up.
    """
    extended = stack.extended
    slots = [extended.slot(path) for path in paths]
    declared = [extended.declaration(path) for path in paths]
    start = extended.theta[slots]
    scale = np.array([abs(value) or abs(one.default) or 1.0
                      for value, one in zip(start, declared, strict=True)])
    low, high = (np.array([one.bounds[side] for one in declared]) / scale for side in (0, 1))
    own = stack.balance == BALANCES.index('controller')
    if not own.any():
        return SLIGHT * scale
    parts = [own & (stack.recording == number) for number in np.unique(stack.recording[own])]

    def left(x: np.ndarray) -> np.ndarray:
        theta = extended.theta.copy()
        theta[slots] = x * scale
        residual = stack.at(theta, extended.on, ('controller',))
        # the integral may have begun anywhere
        return np.concatenate([residual[rows] - np.median(residual[rows]) for rows in parts])

    first = np.clip(start / scale, low, high)
    found = least_squares(left, first, bounds=(low, high), loss='soft_l1', diff_step=1e-3,
                          max_nfev=30)
    off = found.x * scale - start
    return np.where(np.abs(off) > SLIGHT * scale, off, SLIGHT * scale)
