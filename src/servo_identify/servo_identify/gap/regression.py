"""Least squares with bounds on few unknowns, from sums of products, for cross-validation."""

from __future__ import annotations

import numpy as np


def bounded(gram: np.ndarray, slope: np.ndarray, low: np.ndarray,
            high: np.ndarray) -> np.ndarray:
    """
    Minimise ``b' gram b / 2 + slope' b`` for ``low <= b <= high``, shape (unknowns,) each.

    Active set: unknowns that leave their bounds are held there, and let go when the slope says
    that they want back inside.
    """
    size = len(slope)
    if not size:
        return np.zeros(0)
    weight = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    gram = gram / np.outer(weight, weight) + 1e-9 * np.eye(size)
    slope, low, high = slope / weight, low * weight, high * weight
    held = np.zeros(size, dtype=int)  # -1 at low, 1 at high, 0 free
    b = np.zeros(size)
    for _ in range(4 * size + 8):
        free = held == 0
        b = np.where(held < 0, low, np.where(held > 0, high, 0.0))
        if free.any():
            right = -slope[free] - gram[np.ix_(free, ~free)] @ b[~free]
            b[free] = np.linalg.solve(gram[np.ix_(free, free)], right)
        out_low, out_high = free & (b < low), free & (b > high)
        pull = gram @ b + slope
        back = ((held < 0) & (pull < -1e-9)) | ((held > 0) & (pull > 1e-9))
        if out_low.any() or out_high.any():
            excess = np.where(out_low, low - b, np.where(out_high, b - high, 0.0))
            worst = int(np.argmax(excess))
            held[worst] = -1 if out_low[worst] else 1
        elif back.any():
            held[int(np.argmax(np.where(back, np.abs(pull), 0.0)))] = 0
        else:
            break
    return np.clip(b, low, high) / weight


def less(residual: np.ndarray, columns: np.ndarray, low: np.ndarray,
         high: np.ndarray) -> np.ndarray:
    """Return a residual with what some columns, within their bounds, explain of it taken off."""
    if not columns.shape[1]:
        return residual
    return residual + columns @ bounded(columns.T @ columns, columns.T @ residual, low, high)


class Folds:
    """
    Sums of products of a table of columns, by fold of blocks.

    ``target`` has shape (rows,); a fit minimises the sum of squares of ``target + columns b``.
    """

    def __init__(self, target: np.ndarray, columns: np.ndarray, block: np.ndarray,
                 folds: int) -> None:
        self.fold = block % folds
        table = np.column_stack((target, columns)).astype(np.float64)
        self.rows = [np.flatnonzero(self.fold == k) for k in range(folds)]
        self.parts = []
        for rows in self.rows:
            part = table[rows]
            self.parts.append(part.T @ part)
        self.total = np.sum(self.parts, axis=0)

    def grow(self, table: np.ndarray, more: np.ndarray) -> None:
        """Take in further columns ``more`` beside the ``table`` of target and columns so far."""
        for k, rows in enumerate(self.rows):
            cross, own = table[rows].T @ more[rows], more[rows].T @ more[rows]
            self.parts[k] = np.block([[self.parts[k], cross], [cross.T, own]])
        self.total = np.sum(self.parts, axis=0)

    def with_more(self, known: np.ndarray, members: np.ndarray, more: np.ndarray) -> Folds:
        """
        Return the folds of some of the columns with further ones behind them.

        ``known`` is target and those columns side by side, shape (rows, 1 + members).
        """
        small = object.__new__(Folds)
        inner = np.concatenate(([0], members + 1))
        small.fold, small.rows = self.fold, self.rows
        small.parts = [part[np.ix_(inner, inner)] for part in self.parts]
        small.grow(known, more)
        return small

    def fit(self, members: np.ndarray, low: np.ndarray, high: np.ndarray,
            without: int | None = None) -> np.ndarray:
        """Return the coefficients of some columns, with a fold left out."""
        products = self.total if without is None else self.total - self.parts[without]
        inner = members + 1
        return bounded(products[np.ix_(inner, inner)], products[inner, 0], low, high)

    def loss(self, members: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
        """Return the cross-validated sum of squares."""
        total = 0.0
        for k, products in enumerate(self.parts):
            b = self.fit(members, low, high, k)
            inner = members + 1
            total += (products[0, 0] + 2.0 * b @ products[inner, 0]
                      + b @ products[np.ix_(inner, inner)] @ b)
        return float(total)
