"""The numbers that a mechanism is shaped by, where no sum of columns can stand for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from scipy.optimize import minimize, minimize_scalar

SHAPES, FINE = 16, 0.01  # tried between two bounds, and share by which the best is told
LATE = (0.25, 64.0)  # sample periods between which a reading may be late
EACH, REFINED = 8, 60  # of each of several numbers, and tried about the best of these


def best_shape(low: float, high: float, column: Callable[[float], np.ndarray],
               residual: np.ndarray, whole: bool = False, shapes: int = SHAPES) -> float:
    """
    Return the number between ``low`` and ``high`` whose column takes most of a residual.

    ``column(number)`` (samples,) counts as :func:`taken` has it; ``whole``: as it is. The number
    alone then says how much there is, as of a lag: many times a short one is no long one.
    ``shapes`` are tried first, so that none between two of them is passed over.
    """
    def gain(log: float) -> float:
        return _gain(column(float(np.exp(log))), residual, whole)

    grid = np.linspace(np.log(low), np.log(high), shapes)
    best = int(np.argmax([gain(log) for log in grid]))
    found = minimize_scalar(lambda log: -gain(log), method='bounded', options={'xatol': FINE},
                            bounds=(grid[max(best - 1, 0)], grid[min(best + 1, shapes - 1)]))
    return float(np.exp(found.x))


def best_shapes(bounds: Sequence[tuple[float, float]],
                column: Callable[..., np.ndarray], residual: np.ndarray,
                whole: bool = False, shapes: Sequence[int] = ()) -> tuple[float, ...]:
    """
    Return the same of several numbers, each between its ``bounds``; ``column(*numbers)``.

    ``shapes`` of each are tried first.
    """
    shapes = shapes or [EACH] * len(bounds)
    def gain(logs: Sequence[float]) -> float:
        return _gain(column(*np.exp(logs)), residual, whole)

    edges = np.log(np.asarray(bounds))
    grids = [np.linspace(float(low), float(high), count)
             for (low, high), count in zip(edges, shapes, strict=True)]
    best = max(product(*grids), key=gain)
    steps = np.diag((edges[:, 1] - edges[:, 0]) / (2.0 * np.asarray(shapes)))
    inside = np.clip(np.asarray(best) + np.vstack((0.0 * steps[:1], steps)), *edges.T)
    found = minimize(lambda logs: -gain(logs), best, method='Nelder-Mead', bounds=edges,
                     options={'maxfev': REFINED, 'xatol': FINE, 'initial_simplex': inside})
    return tuple(map(float, np.exp(found.x)))


def _gain(column: np.ndarray, residual: np.ndarray, whole: bool) -> float:
    if whole:
        return float(-2.0 * column @ residual - column @ column)
    return float(taken(column[:, None], residual)[0])


def beside(known: np.ndarray, column: Callable[[float], np.ndarray]
           ) -> Callable[[float], np.ndarray]:
    """Return what a column (samples,) of each number does that a ``known`` one does not."""
    square = max(float(known @ known), 1e-300)

    def rest(number: float) -> np.ndarray:
        one = column(number)
        return one - known * (known @ one / square)

    return rest


def taken(table: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """
    Return what each column (samples, n) takes of the squares of a residual, (n,).

    It counts with a positive amplitude alone: one that would need a negative one takes nothing.
    """
    squares = np.maximum((table**2).sum(axis=0), 1e-300)
    return np.minimum(table.T @ residual, 0.0) ** 2 / squares
