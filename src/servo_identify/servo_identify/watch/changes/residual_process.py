r"""
What a residual does while nothing changes: a Gaussian process over motion and time.

A block's feature :math:`y` is taken as

.. math:: y = g^T\beta + f(x) + g^T b(t) + g^T w(t) + e

with the basis :math:`g` (one, covariates, their sizes) and the covariates :math:`x`. The first
term is what a linear error of the twin gives. The second is what a twin errs beyond that, alike
for motions that are alike. :math:`b` varies from move to move and from rest to rest and is
forgotten (Ornstein, Uhlenbeck). :math:`w` is a random walk: zeros wander, gearboxes warm.
:math:`e` is white. So blocks of one move do not count as independent, and a motion that learning
did not show is foretold with doubt.

The variance of each part is that which makes the learned values most likely. The healthy past
alone says how far residuals vary between moves and how fast they drift.

Source: Rasmussen, Williams: Gaussian Processes for Machine Learning, 2006, sections 2.7 and 5.4.1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, LinAlgError, solve_triangular
from scipy.optimize import minimize

from .excitation_level import DIRECTION

REACHES = (0.3, 1.0)
"""Distances over which motions count as alike, of covariates whose largest size is one."""

MEMORIES = (2.0, 8.0)
"""Blocks after which a part that is forgotten is down to 37 %."""

BROAD = 100.0
"""Variance of the shares of the basis before learning, of values whose variance is one."""

_LEAST = 1e-6


class ResidualProcess:
    """
    The process of one feature of one balance, learned from ``values`` (n,).

    ``basis`` (n, 1 + 2 m): one, m covariates, their sizes, as means over each block. ``time`` (n,)
    in blocks, rising. ``matched``: columns of the basis whose shares may wander. The last ``own``
    columns of the basis, if any, are of the values' unit, and their shares of variance one before
    learning: what a value of the servo file may be off.
    """

    def __init__(self, values: np.ndarray, basis: np.ndarray, time: np.ndarray,
                 matched: Sequence[int], own: int = 0) -> None:
        size = np.abs(basis).max(axis=0)
        self.scale = np.where(size > 0.0, size, 1.0)
        self._middle, self.spread = float(values.mean()), float(values.std()) or 1.0
        self._broad = basis.shape[1] - own
        self.scale[self._broad:] = self.spread
        self._matched = list(matched)
        self._basis, self._time = basis / self.scale, time
        learned = (values - self._middle) / self.spread
        self._shares = self._fitted(learned)
        self._root = cholesky(self.covariance(self._basis, time, self._basis, time), lower=True)
        self._left = solve_triangular(self._root, learned, lower=True)

    def unforeseen(self, values: np.ndarray, basis: np.ndarray, time: np.ndarray
                   ) -> tuple[np.ndarray, np.ndarray]:
        """
        Return what learning does not foretell of k blocks, and what it knew of them, (k, n).

        Values are in ``spread``, ``basis`` (k, 1 + 2 m) over ``scale``. The covariance of blocks
        given learning is their covariance less the product of what it knew of them.
        """
        known = solve_triangular(self._root, self.covariance(
            self._basis, self._time, basis, time), lower=True).T
        return (values - self._middle) / self.spread - known @ self._left, known

    def covariance(self, one: np.ndarray, at: np.ndarray, other: np.ndarray, then: np.ndarray
                   ) -> np.ndarray:
        """Return the covariance of blocks with blocks, (n, k), of bases (n, p) and (k, p)."""
        found = self._given(one, other)
        for share, part in zip(self._shares, self._parts(one, at, other, then), strict=True):
            found += share * part
        return found

    def _given(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Return the covariance that the shares of the basis give before learning."""
        k = self._broad
        return BROAD * one[:, :k] @ other[:, :k].T + one[:, k:] @ other[:, k:].T

    def _parts(self, one: np.ndarray, at: np.ndarray, other: np.ndarray, then: np.ndarray
               ) -> list[np.ndarray]:
        """Return the covariances of the parts, of variance one each."""
        one, other = one[:, :self._broad], other[:, :self._broad]
        apart = np.abs(at[:, None] - then)
        same = (apart == 0.0) + 0.0
        count = one.shape[1] // 2
        squares = np.square(one[:, None, 1:1 + count] - other[:, 1:1 + count]).sum(axis=2)
        parts = [np.exp(-0.5 * squares / reach ** 2) for reach in REACHES]
        ways = [_ways(basis) for basis in (one, other)]
        parts += [same * (a[:, None] * b + _LEAST) for a, b in zip(*ways, strict=True)][:2]
        for memory in MEMORIES:
            fading = np.exp(-apart / memory)
            parts += [fading * (a[:, None] * b) for a, b in zip(*ways, strict=True)]
        walked = np.maximum(np.minimum(at[:, None], then) - self._time[0] + 1.0, 0.0)
        walked /= len(self._time)
        parts += [walked * (one[:, q, None] * other[:, q]) for q in self._matched]
        return parts

    def _fitted(self, learned: np.ndarray) -> np.ndarray:
        """Return the variances of the parts that make the learned values most likely."""
        count = len(learned)
        parts = np.array(self._parts(self._basis, self._time, self._basis, self._time))
        flat = parts.reshape(len(parts), -1)
        given = self._given(self._basis, self._basis) + _LEAST * np.eye(count)

        def unlikely(logs: np.ndarray) -> tuple[float, np.ndarray]:
            shares = np.exp(logs)
            try:
                root = cho_factor(given + (shares @ flat).reshape(count, count), lower=True)
            except LinAlgError:
                return 1e10, np.zeros(len(logs))
            solved = cho_solve(root, learned)
            inverse = cho_solve(root, np.eye(count))
            slope = 0.5 * flat @ (inverse - np.outer(solved, solved)).ravel() * shares
            return 0.5 * float(learned @ solved) + float(np.log(np.diag(root[0])).sum()), slope

        begin = np.full(len(parts), 0.03)
        begin[len(begin) - len(self._matched):] = 1e-3
        found = minimize(unlikely, np.log(begin), jac=True, method='L-BFGS-B',
                         bounds=[(-14.0, 4.0)] * len(begin), options={'maxiter': 25})
        return np.exp(found.x)


def _ways(basis: np.ndarray) -> list[np.ndarray]:
    """Return how far each block moves, rests, and in which direction it moves, (n,) each."""
    count = basis.shape[1] // 2
    if count <= DIRECTION:
        return [np.ones(len(basis))]
    moves = np.minimum(1.0, np.abs(basis[:, 1 + count + DIRECTION]))
    return [moves, 1.0 - moves, basis[:, 1 + DIRECTION]]
