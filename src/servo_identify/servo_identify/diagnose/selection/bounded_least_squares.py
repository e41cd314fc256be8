"""Least squares with bounds on few unknowns, from sums of products."""

from __future__ import annotations

from numba import njit
import numpy as np

RIDGE = 1e-9  # share of each column's own square that keeps like columns apart


def bounded(gram: np.ndarray, slope: np.ndarray, low: np.ndarray,
            high: np.ndarray) -> np.ndarray:
    """
    Minimise ``b' gram b / 2 + slope' b`` for ``low <= b <= high``, shape (unknowns,) each.

    Active set (Stark and Parker: Computational Statistics 10, 1995): on its way to the least of
    what is free an unknown that meets its bound is held there. It is let go when the slope says
    that it wants back inside. No step leads up.
    """
    if not len(slope):
        return np.zeros(0)
    return least(gram, slope, low, high, np.zeros(len(slope)), False)


@njit(cache=True, nogil=True)
def least(gram: np.ndarray, slope: np.ndarray, low: np.ndarray, high: np.ndarray,
          near: np.ndarray, sure: bool) -> np.ndarray:
    """Return what :func:`bounded` does, from ``near``; ``sure``: what is at a bound is held."""
    size = len(slope)
    weight, pull = np.ones(size), np.zeros(size)
    for i in range(size):
        if gram[i, i] > 0.0:
            weight[i] = np.sqrt(gram[i, i])
            pull[i] = slope[i] / weight[i]
    scaled = np.zeros((size, size))
    for i in range(size):
        for j in range(size):  # a column of which a difference of sums leaves rounding is none
            if gram[i, i] > 0.0 and gram[j, j] > 0.0:
                share = gram[i, j] / (weight[i] * weight[j])
                scaled[i, j] = min(max(share, -1.0), 1.0)
        scaled[i, i] = 1.0 + RIDGE
    found = _active_set(scaled, pull, low * weight, high * weight, near * weight, sure)
    return np.minimum(np.maximum(found / weight, low), high)


@njit(cache=True, nogil=True)
def every_least(grams: np.ndarray, prior: np.ndarray, low: np.ndarray, high: np.ndarray,
                near: np.ndarray, sure: bool) -> np.ndarray:
    """
    Return the least of several sums of products, (sums, unknowns).

    ``grams`` (sums, 1 + unknowns, 1 + unknowns) of the residual (first) and the columns, ``prior``
    (unknowns,) is added to the squares of these; the others as :func:`least` has them.
    """
    answer = np.empty((len(grams), len(prior)))
    for k in range(len(grams) if len(prior) else 0):
        inner = np.ascontiguousarray(grams[k, 1:, 1:])
        for i in range(len(prior)):
            inner[i, i] += prior[i]
        answer[k] = least(inner, np.ascontiguousarray(grams[k, 1:, 0]), low, high, near, sure)
    return answer


@njit(cache=True, nogil=True)
def most_gained(gram: np.ndarray, slopes: np.ndarray, low: np.ndarray,
                high: np.ndarray) -> np.ndarray:
    """
    Return the largest ``s' b - b' gram b / 2`` for each row s of ``slopes``, (rows,).

    ``low <= b <= high`` is one of several bounds, shape (bounds, unknowns).
    """
    answer = np.zeros(len(slopes))
    for k in range(len(slopes)):
        for side in range(len(low)):
            b = least(gram, -slopes[k], low[side], high[side], np.zeros(len(gram)), True)
            answer[k] = max(answer[k], slopes[k] @ b - 0.5 * (b @ gram @ b))
    return answer


@njit(cache=True, nogil=True)
def _active_set(gram: np.ndarray, slope: np.ndarray, low: np.ndarray, high: np.ndarray,
                near: np.ndarray, sure: bool) -> np.ndarray:
    size = len(slope)
    flat = 1e-10 * np.abs(slope).max()
    free = np.ones(size, dtype=np.bool_)
    b = np.minimum(np.maximum(near, low), high)
    if sure:
        free = (b > low) & (b < high)
    for _ in range(10 * size):
        inner = np.flatnonzero(free)
        there = b.copy()
        if len(inner):
            small = np.empty((len(inner), len(inner)))
            right = np.empty(len(inner))
            for i in range(len(inner)):
                total = -slope[inner[i]]
                for j in range(size):
                    if not free[j]:
                        total -= gram[inner[i], j] * b[j]
                right[i] = total
                for j in range(len(inner)):
                    small[i, j] = gram[inner[i], inner[j]]
            found = np.linalg.solve(small, right)
            for i in range(len(inner)):
                there[inner[i]] = found[i]
        first, share = -1, 1.0
        for i in range(size):
            if there[i] < low[i] or there[i] > high[i]:
                bound = low[i] if there[i] < low[i] else high[i]
                way = (bound - b[i]) / (there[i] - b[i])
                if way < share or first < 0:
                    first, share = i, way
        if first >= 0:
            bound = low[first] if there[first] < low[first] else high[first]
            b += share * (there - b)
            b[first] = bound
            free[first] = False
            continue
        b = there
        pull = gram @ b + slope
        best, most = -1, flat
        for i in range(size):
            if free[i] or low[i] == high[i]:
                continue
            inward = -pull[i] if b[i] <= low[i] else (pull[i] if b[i] >= high[i] else 0.0)
            if inward > most:
                best, most = i, inward
        if best < 0:
            break
        free[best] = True
    return b
