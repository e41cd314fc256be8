"""How likely whitened blocks are under a shape of unknown size, and where their spread changes."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

_SIZES = np.logspace(-1.5, 4.5, 25)  # of a, for shapes whose largest whitened column is one


def onset_of(white: np.ndarray) -> int:
    """Return the row (of at least 4 before the end) from which on the spread is another one."""
    squares = np.square(white).clip(1e-6)
    told = []
    for k in range(1, len(white) - 3):
        before, after = squares[:k].mean(axis=0), squares[k:].mean(axis=0)
        told.append(float((k * np.log(before.clip(1.0)) + (len(white) - k)
                           * np.log(after.clip(1.0))).sum()))
    return 1 + int(np.argmin(told))


def solved(roots: list[np.ndarray], columns: np.ndarray) -> np.ndarray:
    """Return columns (n, e) whitened, each equation by its root."""
    return np.column_stack([
        solve_triangular(root, columns[:, q], lower=True) if columns[:, q].any()
        else np.zeros(len(columns)) for q, root in enumerate(roots)])


def likelihood(white: np.ndarray, shapes: list[np.ndarray], misfit: float, as_one: bool) -> float:
    """
    Return the logarithm of the likelihood of a shape of any size, over that of no change.

    Columns have sizes of their own, or go together ``as_one`` with the units that they have.
    """
    w, s = white.ravel(), np.array([shape.ravel() for shape in shapes]).T
    scale = np.sqrt(np.square(s).sum(axis=0))
    if not scale.max() > 0.0:
        return 0.0
    s = s / (scale.max() if as_one else np.where(scale > 0.0, scale, 1.0))
    share = misfit ** 2 * np.square(s).sum(axis=1)
    told = []
    for size in np.square(_SIZES):
        d = 1.0 + size * share
        inner = np.eye(s.shape[1]) + size * (s.T / d) @ s
        root = cholesky(inner, lower=True)
        seen = solve_triangular(root, (s.T / d) @ w, lower=True)
        told.append(-0.5 * float(np.log(d).sum()) - float(np.log(np.diag(root)).sum())
                    + 0.5 * float(np.square(w).sum() - np.square(w) @ (1.0 / d)
                                  + size * (seen @ seen)))
    return float(logsumexp(told)) - float(np.log(len(told)))
