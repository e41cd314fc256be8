"""The one number that a mechanism is shaped by, where no sum of columns can stand for it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

SHAPES, FINE = 16, 0.01  # tried between two bounds, and share by which the best is told


def best_shape(low: float, high: float, column: Callable[[float], np.ndarray],
               residual: np.ndarray) -> float:
    """
    Return the number between ``low`` and ``high`` whose column takes most of a residual.

    ``column(number)`` (samples,) counts with a positive amplitude alone: one that takes from the
    residual by a negative one takes nothing.
    """
    def taken(log: float) -> float:
        one = column(float(np.exp(log)))
        return float(min(one @ residual, 0.0) ** 2 / max(one @ one, 1e-300))

    grid = np.linspace(np.log(low), np.log(high), SHAPES)
    best = int(np.argmax([taken(log) for log in grid]))
    found = minimize_scalar(lambda log: -taken(log), method='bounded', options={'xatol': FINE},
                            bounds=(grid[max(best - 1, 0)], grid[min(best + 1, SHAPES - 1)]))
    return float(np.exp(found.x))
