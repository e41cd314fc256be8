"""Bounded Levenberg-Marquardt on normal equations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import lsq_linear

from .fit_problem import Normal, Problem
from .shooting import Unknowns
from .start_search import best_starts

SHARES = (1.0, 0.3, 0.0)
"""How far the starts may follow the linear model, which a shaft that sticks makes a liar."""

SMALL = 1e-4


def solved(problem: Problem, unknowns: Unknowns, iterations: int, tolerance: float,
           held: np.ndarray, told: Callable[[int, float], None], worth: float = 0.0,
           unseen: np.ndarray | None = None) -> tuple[Unknowns, int]:
    """
    Walk downhill until a step moves the shared numbers hardly at all.

    That is by less than ``tolerance`` of a standard error of independent residuals (the honest
    ones are larger), or none of them by more than :data:`SMALL` of its scale. A step that takes
    less than a share ``worth`` of the cost is the last one too.
    ``held`` (p,) marks shared numbers that stay where they are. Along ``unseen`` (values, d),
    the changes that the recordings do not show, values move only where bounds force them to.
    ``told(iteration, cost)`` is
    called at each accepted step and may raise to stop the fit. Returns the unknowns and how many
    steps were taken.
    """
    damping = 1e-3
    done = 0
    while done < iterations:
        normal = problem.linearised(unknowns)
        low, high = problem.room(unknowns)
        gained = 0.0
        while damping < 1e9:
            step = _step(normal, damping, low, high, held, unseen)
            trial, cost = best_starts(problem, [problem.stepped(unknowns, normal, step, share)
                                                for share in SHARES])
            if cost < normal.cost:
                gained = (normal.cost - cost) / normal.cost
                break
            damping *= 6.0
            if np.abs(step).max(initial=0.0) < 1e-9:
                break
        if gained == 0.0:
            break
        done += 1
        damping = max(damping / 8.0, 1e-9)
        moved = np.sqrt(step @ normal.hessian @ step * normal.residual.size / (2.0 * cost))
        unknowns = trial
        told(done, cost)
        if moved < tolerance or gained < worth or (
                len(step) and damping < 1e-3 and np.abs(step).max() < SMALL):
            break
    return unknowns, done


def _step(normal: Normal, damping: float, low: np.ndarray, high: np.ndarray,
          held: np.ndarray, unseen: np.ndarray | None) -> np.ndarray:
    free = ~held
    step = np.zeros(len(held))
    if not free.any():
        return step
    hessian = normal.hessian[np.ix_(free, free)]
    size = np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    gradient = normal.gradient[free] / size
    scaled = hessian / np.outer(size, size)
    scaled[np.diag_indices_from(scaled)] += damping
    if unseen is not None and unseen.size:
        change = np.zeros((len(held), unseen.shape[1]))
        change[:len(unseen)] = unseen
        change = change[free]
        seen = np.eye(len(size)) - (size[:, None] * change) @ (change / size[:, None]).T
        held_back = change / size[:, None]  # weak, so that bounds come first
        scaled = seen.T @ scaled @ seen + held_back @ held_back.T
        gradient = seen.T @ gradient
    values, vectors = np.linalg.eigh(scaled)
    root = np.sqrt(np.maximum(values, 1e-12 * values[-1]))
    below = np.minimum(low[free] * size, 0.0) - 1e-12
    above = np.maximum(high[free] * size, 0.0) + 1e-12
    answer = lsq_linear((vectors * root).T, -(vectors.T @ gradient) / root, (below, above),
                        method='bvls')
    step[free] = np.clip(answer.x / size, low[free], high[free])
    return step
