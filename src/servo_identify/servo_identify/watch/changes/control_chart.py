"""One chart of the change detector: regression, whitening and windows of a series of blocks."""

from __future__ import annotations

from collections.abc import Sequence
from math import log, nan, sqrt

import numpy as np
from scipy.stats import t as student

WINDOWS = (2, 4, 8, 16, 32)
"""Blocks that a change may be spread over."""

ORDERS = (0, 1, 2, 3)
"""Orders of the autoregression to choose from, by Schwarz's criterion."""

MOST = 6.0
"""Standard deviations at which an innovation is cut."""


class Chart:
    """
    One feature of one balance: its regression, its whitening, its windows.

    ``rate``: false alarms a block of each of the regressors ``matched`` (columns of the
    covariates), of all windows together. A change counts from ``least`` on, in the unit of the
    values: the root mean square of what it adds to them, driven as while learning.
    """

    def __init__(self, values: np.ndarray, covariates: np.ndarray, rate: float,
                 matched: Sequence[int], every: int = 1, root: float = 1.0,
                 least: float = 0.0) -> None:
        good = np.isfinite(values)
        whole = good.sum() // every
        values = values[good][:whole * every].reshape(whole, every).mean(axis=1) ** root
        covariates = covariates[good][:whole * every].reshape(whole, every, -1).mean(axis=1)
        self._every, self._root, self._matched = every, root, list(matched)
        size = np.abs(covariates).max(axis=0)
        self._scale = np.where(size > 0.0, size, 1.0)
        basis = covariates / self._scale
        slopes = _solved(basis, values)
        self._weights = _autoregression(values - basis @ slopes)
        order = len(self._weights)
        whitened, answers = self._white(basis), self._white(values[:, None])[:, 0]
        slopes = _solved(whitened, answers)
        self.slopes = slopes / self._scale
        innovations = answers - whitened @ slopes
        freedom = max(3.0, len(innovations) - basis.shape[1] - order)
        self._spread = sqrt(float(innovations @ innovations) / freedom)
        self._doubt = np.linalg.inv(_gram(whitened))
        self._least = least / np.maximum(np.sqrt(np.square(basis).mean(axis=0)), 1e-12)
        self._wider = {w: self._unsteady(whitened, innovations, w) for w in WINDOWS}
        self._thresholds = [float(student.isf(rate / len(WINDOWS) * (w // 2) / 2.0, freedom))
                            for w in WINDOWS]
        left = values - basis @ slopes
        self._before = [np.append(b, v) for b, v in zip(
            basis[whole - order:], left[whole - order:], strict=True)]
        self._recent = np.empty((0, basis.shape[1] + 2))  # regressors, innovation, the same cut
        self._waiting: list[tuple[float, np.ndarray]] = []
        self._blocks = 0

    def take(self, value: float, covariates: np.ndarray) -> tuple[float, int]:
        """Return (deviations, blocks) of the window that tells of a change; (0, 0): none does."""
        if not np.isfinite(value):
            self.interrupt()
            return 0.0, 0
        self._waiting.append((value, covariates))
        if len(self._waiting) < self._every:
            return 0.0, 0
        value = (sum(v for v, _ in self._waiting) / self._every) ** self._root
        covariates = sum(c for _, c in self._waiting) / self._every
        self._waiting.clear()
        row = np.append(covariates / self._scale, value - float(covariates @ self.slopes))
        self._before.append(row)
        if len(self._before) <= len(self._weights):
            return 0.0, 0
        white = self._white(np.array(self._before))[0]
        del self._before[0]
        most = MOST * self._spread
        white = np.append(white, min(max(white[-1], -most), most))
        self._recent = np.vstack([self._recent[1 - WINDOWS[-1]:], white])
        self._blocks += 1
        return self._judged()

    def _judged(self) -> tuple[float, int]:
        """Return the deviation, not cut, and length of the first window that tells of a change."""
        for window, threshold in zip(WINDOWS, self._thresholds, strict=True):
            if window > len(self._recent) or self._blocks % (window // 2):
                continue
            rows, errors = self._recent[-window:, :-2], self._recent[-window:, -2:]
            gram, shares = rows.T @ rows, rows.T @ errors
            for q in self._matched:
                spread = self._spread * sqrt(self._wider[window][q] * gram[q, q]
                                             + gram[q] @ self._doubt @ gram[q])
                if abs(shares[q, 1]) > threshold * spread > 0.0 and (
                        abs(shares[q, 0]) >= self._least[q] * gram[q, q]):
                    return float(shares[q, 0] / spread), window * self._every
        return 0.0, 0

    def _unsteady(self, whitened: np.ndarray, innovations: np.ndarray, window: int) -> np.ndarray:
        """Return how much wider windows spread while learning than whiteness says, at least 1."""
        starts = range(0, len(whitened) - window + 1, window // 2)
        sums, sizes = np.zeros(whitened.shape[1]), np.zeros(whitened.shape[1])
        for part in (slice(start, start + window) for start in starts):
            sums += (whitened[part].T @ innovations[part]) ** 2
            sizes += np.square(whitened[part]).sum(axis=0) * self._spread ** 2
        return np.maximum(1.0, sums / np.maximum(sizes, 1e-300))

    def _white(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (n, ...) less what those before foretell of them, shape (n - order, ...)."""
        order = len(self._weights)
        white = rows[order:].copy()
        for k, weight in enumerate(self._weights):
            white -= weight * rows[order - k - 1:len(rows) - k - 1]
        return white

    def interrupt(self) -> None:
        """Forget the last blocks: what comes does not continue them."""
        self._before, self._recent = [], self._recent[:0]
        self._waiting.clear()


def _gram(basis: np.ndarray) -> np.ndarray:
    return basis.T @ basis + 1e-6 * len(basis) * np.eye(basis.shape[1])


def _solved(basis: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.linalg.solve(_gram(basis), basis.T @ values)


def _autoregression(left: np.ndarray) -> np.ndarray:
    """
    Return the weights, nearest first, of the autoregression that pays.

    One whose weights sum to less than zero is none: it would take a small shift for a large one,
    and without it the spread is overstated, not understated.
    """
    best = (nan, np.empty(0))
    top = max(ORDERS)
    for order in ORDERS:
        if len(left) < 10 * (top + 1) and order:
            break
        past = np.column_stack([left[top - k - 1:len(left) - k - 1] for k in range(order)]
                               or [np.empty((len(left) - top, 0))])
        weights = np.linalg.lstsq(past, left[top:], rcond=None)[0]
        innovations = left[top:] - past @ weights
        variance = max(float(np.square(innovations).mean()), 1e-300)
        score = len(innovations) * log(variance) + order * log(len(innovations))
        if not score >= best[0] and weights.sum() >= 0.0:
            best = (score, weights)
    return best[1]
