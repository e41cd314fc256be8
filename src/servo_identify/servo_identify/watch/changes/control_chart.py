"""One chart of the change detector: windows of a series of blocks against what is usual."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import stdtrit

from .residual_process import ResidualProcess

WINDOWS = (8, 16, 32, 64, 128)
"""Blocks that a change may be spread over."""

TOGETHER = 4
"""Blocks that are taken together, to save time."""

KEPT = 144
"""Blocks that are kept, to the newest one: those of the longest window and some before."""

MOST = 2.5
"""Standard deviations at which an innovation is cut: a window needs several that agree."""

LEARNED = 300
"""Blocks of learning that are kept at most, evenly spread over it."""


class Chart:
    """
    One feature of one balance: its process while nothing changes, its windows.

    ``rate``: false alarms a block of each of the regressors ``matched`` (columns of the
    covariates), of all windows together. A change counts from ``least`` on, in the unit of the
    values: the root mean square of what it adds to them, driven as while learning.
    """

    def __init__(self, values: np.ndarray, covariates: np.ndarray, time: np.ndarray, rate: float,
                 matched: Sequence[int], least: float = 0.0) -> None:
        good = np.flatnonzero(np.isfinite(values))
        good = good[np.linspace(0, len(good) - 1, min(LEARNED, len(good))).astype(int)]
        self._process = ResidualProcess(values[good], covariates[good], time[good], matched)
        self._matched, self._rate = list(matched), rate
        basis = covariates[good] / self._process.scale
        self._least = least / np.maximum(np.sqrt(np.square(basis).mean(axis=0)), 1e-12)
        self._rows, self._time = np.empty((0, basis.shape[1])), np.empty(0)
        self._left, self._known = np.empty(0), np.empty((0, len(good)))
        self._covariance = np.empty((0, 0))
        self._waiting: list[tuple[float, np.ndarray, float]] = []
        self._blocks = 0
        self._judged: list[tuple[int, float]] = []  # block, mean square of its deviations
        self._seen = self._squares = float(max(3, len(good) - basis.shape[1]))

    def take(self, value: float, covariates: np.ndarray, time: float) -> tuple[float, int]:
        """Return (deviations, blocks) of the window that tells of a change; (0, 0): none does."""
        if not np.isfinite(value):
            return 0.0, 0
        self._waiting.append((value, covariates / self._process.scale, time))
        if len(self._waiting) < TOGETHER:
            return 0.0, 0
        values, rows, times = (np.array(one) for one in zip(*self._waiting, strict=True))
        self._waiting.clear()
        left, known = self._process.unforeseen(values, rows, times)
        old = len(rows) - KEPT
        self._rows = np.concatenate([self._rows[old:], rows])
        self._time = np.concatenate([self._time[old:], times])
        self._left = np.concatenate([self._left[old:], left])
        self._known = np.concatenate([self._known[old:], known])
        new = self._process.covariance(rows, times, self._rows, self._time) - known @ self._known.T
        self._covariance = np.block([
            [self._covariance[old:, old:], new[:, :-len(rows)].T], [new]])
        self._blocks += len(rows)
        return self._judge()

    def _judge(self) -> tuple[float, int]:
        """Return (deviations, blocks) of the window that tells most of a change."""
        due = [w for w in WINDOWS if w <= len(self._rows) and not self._blocks % (w // 2)]
        if not due:
            return 0.0, 0
        shapes = np.zeros((len(self._rows), len(due), len(self._matched)))
        for k, window in enumerate(due):
            shapes[-window:, k] = self._rows[-window:, self._matched]
        root = cholesky(self._covariance + 1e-9 * np.eye(len(self._rows)), lower=True)
        white = solve_triangular(root, np.column_stack(
            [self._left, shapes.reshape(len(shapes), -1)]), lower=True)
        shapes = white[:, 1:].reshape(shapes.shape)
        size = np.sqrt(np.maximum(np.square(shapes).sum(axis=0), 1e-12))
        whole = np.einsum('nkq,n->kq', shapes, white[:, 0]) / size
        cut = np.einsum('nkq,n->kq', shapes, np.clip(white[:, 0], -MOST, MOST)) / size
        wider = self._usual(float(np.square(cut).mean()))
        told = []
        for k, window in enumerate(due):
            chance = self._rate / len(WINDOWS) * (window // 2) / 2.0
            most = -float(stdtrit(self._seen, chance)) * wider
            for n, q in enumerate(self._matched):
                if abs(cut[k, n]) > most and (abs(whole[k, n]) / size[k, n] * self._process.spread
                                              >= self._least[q]):
                    told.append((float(cut[k, n]) / wider, window))
        return max(told, key=lambda one: abs(one[0]), default=(0.0, 0))

    def _usual(self, squares: float) -> float:
        """
        Return how much wider windows have spread than the process says, at least 1.

        A window counts as usual once it is so old that a change in it would have been found.
        """
        self._judged.append((self._blocks, squares))
        while self._judged and self._judged[0][0] < self._blocks - KEPT:
            self._squares += self._judged.pop(0)[1]
            self._seen += 1.0
        return sqrt(max(1.0, self._squares / self._seen))
