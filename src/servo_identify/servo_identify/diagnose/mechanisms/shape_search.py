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

    ``column(number)`` (samples,) counts as :func:`taken` has it.
    """
    def gain(log: float) -> float:
        return float(taken(column(float(np.exp(log)))[:, None], residual)[0])

    grid = np.linspace(np.log(low), np.log(high), SHAPES)
    best = int(np.argmax([gain(log) for log in grid]))
    found = minimize_scalar(lambda log: -gain(log), method='bounded', options={'xatol': FINE},
                            bounds=(grid[max(best - 1, 0)], grid[min(best + 1, SHAPES - 1)]))
    return float(np.exp(found.x))


def taken(table: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """
    Return what each column (samples, n) takes of the squares of a residual, (n,).

    It counts with a positive amplitude alone: one that would need a negative one takes nothing.
    """
    squares = np.maximum((table**2).sum(axis=0), 1e-300)
    return np.minimum(table.T @ residual, 0.0) ** 2 / squares
