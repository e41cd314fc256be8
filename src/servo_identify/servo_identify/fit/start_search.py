"""
The starts of the horizons, found where slopes mislead.

A shaft that sticks, or stops soon after its horizon began, answers to its start with a kink. So
each horizon chooses among several trials by itself, and takes shorter steps where the linear model
was wrong.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .fit_problem import Problem
from .shooting import Unknowns


def best_starts(problem: Problem, trials: list[Unknowns]) -> tuple[Unknowns, float]:
    """
    Return the unknowns with, for each horizon, the starts of the trial that suits it best.

    The first trial goes the whole way of the linear model, the last none of it; a horizon for
    which that is best takes shorter steps from now on.
    """
    starts, costs, best = _chosen(problem, trials)
    shorter = np.where(best == len(trials) - 1, 30.0 * problem.damping + 1e-3, problem.damping)
    damping = np.where(best == 0, 0.1 * problem.damping, shorter)
    problem.damping = np.clip(np.where(damping < 1e-4, 0.0, damping), 0.0, 1e6)
    return replace(trials[0], starts=starts), float(costs.sum())


def searched(problem: Problem, unknowns: Unknowns) -> tuple[Unknowns, bool]:
    """
    Return the unknowns with starts that a search along each offset finds better, and if it did.

    Only horizons that are left with more residual than most are searched.
    """
    shooting, better = problem.shooting, False
    for turn in range(3):
        residual = problem.residual(shooting.simulate([unknowns])[0])
        each = problem.costs(residual, unknowns) / problem.lengths
        poor = each > 1.5 * np.median(each)
        if not poor.any():
            break
        trials = [unknowns, replace(unknowns, starts=np.zeros_like(unknowns.starts))]
        for column in range(shooting.offsets):
            for way in (-1.0, -0.3, -0.1, 0.1, 0.3, 1.0):
                starts = unknowns.starts.copy()
                starts[:, column] += way * problem.start_prior[:, column] / (1.0 + 2.0 * turn)
                trials.append(replace(unknowns, starts=starts))
        starts, costs, _ = _chosen(problem, trials, poor)
        better |= costs[poor].sum() < 0.9 * (each * problem.lengths)[poor].sum()
        unknowns = replace(unknowns, starts=starts)
    return unknowns, better


def _chosen(problem: Problem, trials: list[Unknowns], only: np.ndarray | None = None
            ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rolled = problem.shooting.simulate(trials, only)
    known = np.geterr()  # a thread has its own

    def cost(trial: Unknowns, y: list[np.ndarray]) -> np.ndarray:
        with np.errstate(**known):
            return problem.costs(problem.residual(y), trial)

    costs = np.array(list(problem.shooting.pool.map(cost, trials, rolled)))
    best = np.argmin(np.where(np.isfinite(costs), costs, np.inf), axis=0)
    horizon = np.arange(len(best))
    starts = np.array([trial.starts for trial in trials])[best, horizon]
    return starts, costs[best, horizon], best
