"""What a set leaves of each equation with one hypothesis more, from sums of products, compiled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from numba import njit
import numpy as np

from .bounded_least_squares import least
from .regression import Sums


@dataclass(frozen=True)
class Leavings:
    """
    Sums of products of several equations, ready to tell what a set of columns leaves.

    ``whole`` (columns, columns) the sums over all equations that a fit minimises, with ``prior``
    (columns,) added to its diagonal; ``flat`` the tables of the equations that are judged, one
    behind the other from ``firsts``; ``where`` (equations, columns) the places of the columns in
    each, -1 where they do not move it; ``floor`` and ``count`` (equations,) below what nothing
    counts, and the observations.
    """

    whole: np.ndarray
    prior: np.ndarray
    flat: np.ndarray
    firsts: np.ndarray
    where: np.ndarray
    floor: np.ndarray
    count: np.ndarray

    @classmethod
    def of(cls, sums: Sums, prior: np.ndarray, tables: Mapping[int, np.ndarray],
           where: list[np.ndarray], floor: np.ndarray, count: np.ndarray) -> Leavings:
        """Return them for the equations of ``tables``; the others are by all equations."""
        judged = list(tables)
        flat = np.concatenate([np.zeros(0), *(table.ravel() for table in tables.values())])
        firsts = np.cumsum([0, *(table.size for table in tables.values())])[:-1]
        size = len(sums.whole)
        places = np.array([where[i] for i in judged], dtype=np.int64).reshape(len(judged), size)
        return cls(sums.whole, prior, flat, firsts.astype(np.int64), places, floor[judged],
                   count[judged])

    def left(self, columns: np.ndarray, values: np.ndarray) -> float:
        """Return what values leave, nats: n/2 log of the mean square of each equation."""
        return float(_left(columns, values, self.flat, self.firsts, self.where, self.floor,
                           self.count))

    def fitted(self, columns: np.ndarray, low: np.ndarray, high: np.ndarray,
               near: np.ndarray) -> tuple[float, np.ndarray]:
        """Return (what is left, the values) of the best fit; ``near`` is a guess of the values."""
        values = _fitted(self.whole, self.prior, columns, low, high, near)
        return self.left(columns, values), values[1:]


@njit(cache=True, nogil=True)
def _fitted(whole: np.ndarray, prior: np.ndarray, columns: np.ndarray, low: np.ndarray,
            high: np.ndarray, near: np.ndarray) -> np.ndarray:
    size = len(columns) - 1
    gram, slope, values = np.empty((size, size)), np.empty(size), np.ones(size + 1)
    for i in range(size):
        slope[i] = whole[columns[i + 1], columns[0]]
        for j in range(size):
            gram[i, j] = whole[columns[i + 1], columns[j + 1]]
        gram[i, i] += prior[columns[i + 1]]
    values[1:] = least(gram, slope, low, high, near, True)
    return values


@njit(cache=True, nogil=True)
def _left(columns: np.ndarray, values: np.ndarray, flat: np.ndarray, firsts: np.ndarray,
          where: np.ndarray, floor: np.ndarray, count: np.ndarray) -> float:
    total = 0.0
    place, some = np.empty(len(columns), np.int64), np.empty(len(columns))
    for e in range(len(firsts)):
        moved, size = 0, 0
        for k in range(where.shape[1]):
            size += where[e, k] >= 0
        for k in range(len(columns)):
            if where[e, columns[k]] >= 0:
                place[moved], some[moved] = where[e, columns[k]], values[k]
                moved += 1
        square = 0.0
        for i in range(moved):
            row, part = firsts[e] + place[i] * size, 0.0
            for j in range(moved):
                part += flat[row + place[j]] * some[j]
            square += some[i] * part
        total += 0.5 * count[e] * np.log(max(square, floor[e], 1e-12))
    return total
