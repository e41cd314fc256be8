"""Least squares with bounds on few unknowns, from sums of products, for cross-validation."""

from __future__ import annotations

from collections.abc import Sequence
import itertools

import numpy as np


def bounded(gram: np.ndarray, slope: np.ndarray, low: np.ndarray,
            high: np.ndarray) -> np.ndarray:
    """
    Minimise ``b' gram b / 2 + slope' b`` for ``low <= b <= high``, shape (unknowns,) each.

    Active set, from nothing on and never out of the bounds (Stark and Parker, 1995): on its way to
    the least of what is free an unknown that meets its bound is held there, and let go when the
    slope says that it wants back inside. No step leads up, so that no set of bounds comes again.
    """
    size = len(slope)
    if not size:
        return np.zeros(0)
    weight = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    gram = gram / np.outer(weight, weight) + 1e-9 * np.eye(size)
    slope, bounds = slope / weight, (low, high)
    low, high = low * weight, high * weight
    flat = 1e-10 * np.abs(slope).max()
    free = np.ones(size, dtype=bool)
    b = np.clip(np.zeros(size), low, high)
    for _ in range(10 * size):
        there = b.copy()
        if free.any():
            right = -slope[free] - gram[np.ix_(free, ~free)] @ b[~free]
            there[free] = np.linalg.solve(gram[np.ix_(free, free)], right)
        out = (there < low) | (there > high)
        if out.any():
            bound = np.where(there < low, low, high)
            way = (bound[out] - b[out]) / (there[out] - b[out])
            first = np.flatnonzero(out)[np.argmin(way)]
            b += way.min() * (there - b)
            b[first], free[first] = bound[first], False
            continue
        b = there
        pull = gram @ b + slope
        inward = np.where(b <= low, -pull, np.where(b >= high, pull, 0.0))
        inward[free | (low == high)] = 0.0
        if inward.max() <= flat:
            break
        free[np.argmax(inward)] = True
    return np.clip(b / weight, *bounds)


def less(residual: np.ndarray, columns: np.ndarray, low: np.ndarray,
         high: np.ndarray) -> np.ndarray:
    """Return a residual with what some columns, within their bounds, explain of it taken off."""
    if not columns.shape[1]:
        return residual
    return residual + columns @ bounded(columns.T @ columns, columns.T @ residual, low, high)


AHEAD = 3  # times the columns that room is kept for: what is not used costs no memory


class Folds:
    """
    A table of columns with its sums of products by fold of blocks.

    ``target`` has shape (rows,), ``tables`` (rows, columns) each; a fit minimises the sum of
    squares of ``target + columns b``, each row times its ``weight``. Inside, columns lie side by
    side in memory, for they come and go, and rows by fold.
    """

    def __init__(self, target: np.ndarray, tables: Sequence[np.ndarray], block: np.ndarray,
                 folds: int, weight: np.ndarray) -> None:
        fold = block % folds
        self._order = np.argsort(fold, kind='stable')
        self._back = np.argsort(self._order)
        ends = np.searchsorted(fold[self._order], np.arange(folds + 1))
        self._rows = [slice(first, last) for first, last in itertools.pairwise(ends)]
        columns = 1 + sum(table.shape[1] for table in tables)
        self._room = np.empty((len(target), AHEAD * columns), order='F')
        self._size = 0
        for table in (target[:, None], *tables):
            self._put(table[self._order])
        self.weigh(weight)

    def weigh(self, weight: np.ndarray) -> None:
        """Have each row count by another weight."""
        self._weight = weight[self._order, None]
        table = self._room[:, :self._size]
        self.parts = self._products(table, table)
        self.total = self.parts.sum(axis=0)

    def columns(self, members: np.ndarray) -> np.ndarray:
        """Return some of the columns, shape (rows, members)."""
        return self._room[:, members + 1][self._back]

    def grow(self, more: np.ndarray) -> np.ndarray:
        """Take in further columns, behind those that are there, and return their numbers."""
        more, first = more[self._order], self._size - 1
        self._join(self._room[:, :self._size], self.parts, more)
        self._put(more)
        return np.arange(first, first + more.shape[1])

    def table(self, members: np.ndarray) -> np.ndarray:
        """Return the target and some of the columns side by side, for :meth:`with_more`."""
        return self._room[:, np.concatenate(([0], members + 1))]

    def with_more(self, known: np.ndarray, members: np.ndarray, more: np.ndarray) -> Folds:
        """
        Return the sums of some of the columns with further ones behind them.

        ``known`` is the :meth:`table` of those.
        """
        small = object.__new__(Folds)
        small._rows, small._weight = self._rows, self._weight
        inner = np.concatenate(([0], members + 1))
        small._join(known, self.parts[:, inner[:, None], inner], more[self._order])
        return small

    def left(self, members: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return what is left of the target, each row predicted from the other folds."""
        left, table = self._room[:, 0].copy(), self._room[:, members + 1]
        for k, rows in enumerate(self._rows):
            left[rows] += table[rows] @ self.fit(members, low, high, k)
        return left[self._back]

    def _put(self, more: np.ndarray) -> None:
        size = self._size + more.shape[1]
        if size > self._room.shape[1]:
            room = np.empty((len(self._room), AHEAD * size), order='F')
            room[:, :self._size] = self._room[:, :self._size]
            self._room = room
        self._room[:, self._size:size] = more
        self._size = size

    def _join(self, known: np.ndarray, parts: np.ndarray, more: np.ndarray) -> None:
        """Take the sums of products of known columns with each other and with further ones."""
        old, new = known.shape[1], more.shape[1]
        self.parts = np.empty((len(parts), old + new, old + new))
        cross = self._products(known, more)
        self.parts[:, :old, :old] = parts
        self.parts[:, :old, old:], self.parts[:, old:, :old] = cross, cross.swapaxes(1, 2)
        self.parts[:, old:, old:] = self._products(more, more)
        self.total = self.parts.sum(axis=0)

    def _products(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        return np.array([left[rows].T @ (right[rows] * self._weight[rows]**2)
                         for rows in self._rows])

    def fit(self, members: np.ndarray, low: np.ndarray, high: np.ndarray,
            without: int | None = None) -> np.ndarray:
        """Return the coefficients of some columns, with a fold left out."""
        products = self.total if without is None else self.total - self.parts[without]
        inner = members + 1
        return bounded(products[np.ix_(inner, inner)], products[inner, 0], low, high)

    def least(self, members: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
        """Return the sum of squares of one fit to all rows, below which no :meth:`loss` lies."""
        return _square(self.total, members + 1, self.fit(members, low, high))

    def loss(self, members: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
        """Return the cross-validated sum of squares."""
        return sum(_square(products, members + 1, self.fit(members, low, high, k))
                   for k, products in enumerate(self.parts))


def _square(products: np.ndarray, inner: np.ndarray, b: np.ndarray) -> float:
    return float(products[0, 0] + 2.0 * b @ products[inner, 0]
                 + b @ products[np.ix_(inner, inner)] @ b)
