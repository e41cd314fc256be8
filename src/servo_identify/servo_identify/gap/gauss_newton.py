"""
Least squares within bounds where the slopes are what costs.

Gauss and Newton's steps, each to the least of the linear problem between the bounds, so that an
unknown that ends at a bound is there at once: scipy's trust regions halve the way to it with every
step. Slopes that a step has borne out are kept and mended after Broyden.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .regression import bounded

STEPS = 12
ENOUGH = 1e-3  # share of the sum of squares by which the last step makes it smaller
LINEAR = 0.3  # share of a change that its slopes may have missed and still be kept
STIFFEST = 1e3  # damping at which no step leads down


def gauss_newton(left: Callable[[np.ndarray], np.ndarray],
                 slopes: Callable[[np.ndarray], np.ndarray], x: np.ndarray, low: np.ndarray,
                 high: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """
    Minimise the sum of squares of ``left(x)`` for ``low <= x <= high``, shape (unknowns,) each.

    ``slopes(x)`` has shape (rows, unknowns). Returns (x, what is left there, slopes there or
    near), from the best of at most STEPS steps; none is worse than the start.
    """
    residual, table, fresh, damping = left(x), slopes(x), True, 0.0
    for _ in range(STEPS):
        gram = table.T @ table
        step = bounded(gram + damping * np.diag(np.diag(gram)), table.T @ residual,
                       low - x, high - x)
        there = np.clip(x + step, low, high)
        after = left(there)
        gain = residual @ residual - after @ after
        if gain <= 0.0:
            if not fresh:
                table, fresh = slopes(x), True
                continue
            damping = max(10.0 * damping, 0.01)
            if not step.any() or damping > STIFFEST:
                break
            continue
        missed, enough = after - residual - table @ step, gain < ENOUGH * (residual @ residual)
        kept = np.linalg.norm(missed) < LINEAR * np.linalg.norm(after - residual)
        x, residual, damping = there, after, 0.1 * damping
        if enough:
            break
        fresh = not kept
        table = table + np.outer(missed, step / (step @ step)) if kept else slopes(x)
    return x, residual, table
