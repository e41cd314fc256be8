"""A set of causes with values fitted to the balances."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .balance import BALANCES
from .candidates import Candidate, Extended
from .gauss_newton import gauss_newton
from .regression import bounded
from .screening import Screening
from .stack import Stack


@dataclass(frozen=True)
class Unknown:
    """One number that a fit may move: a parameter (or a number of a row) with its bounds."""

    path: str
    element: int
    low: float
    high: float
    logarithmic: bool = False


@dataclass(frozen=True)
class Explanation:
    """
    Causes with fitted values.

    ``theta`` and ``on`` are those of the extended servo; ``std`` gives the standard deviation of
    each unknown, from the scatter of the scores over blocks.
    """

    causes: tuple[Candidate, ...]
    theta: np.ndarray
    on: np.ndarray
    unknowns: tuple[Unknown, ...]
    std: np.ndarray
    at_bound: tuple[str, ...] = field(default=())

    def values(self, extended: Extended) -> dict[tuple[str, int], float]:
        """Return by (path, element) each number that was fitted."""
        return {(u.path, u.element): float(self.theta[extended.slot(u.path, u.element)])
                for u in self.unknowns}

    def spread(self, path: str, element: int = 0) -> float:
        """Standard deviation of one number; NaN where it was not fitted."""
        for unknown, std in zip(self.unknowns, self.std, strict=True):
            if unknown.path == path and unknown.element == element:
                return float(std)
        return float('nan')


def as_given(stack: Stack) -> Explanation:
    """Return the servo as its file says, with nothing fitted."""
    extended = stack.extended
    return Explanation((), extended.nominal, extended.on, (), np.zeros(0))


def fit(screening: Screening, chosen: list[int],
        near: Explanation | None = None) -> Explanation:
    """
    Fit amplitudes, shapes and what may move within tolerance, all at once, to the balances.

    It starts from ``near``, the fit of a set with most of these causes, where there is one. Each
    set of causes is fitted once for a screening: acceptance and shrink ask for the same ones.
    """
    key = tuple(sorted(chosen))
    if key not in screening.fits:
        screening.fits[key] = _fitted(screening, chosen, near)
    return screening.fits[key]


def _fitted(screening: Screening, chosen: list[int], near: Explanation | None) -> Explanation:
    stack, library = screening.stack, screening.library
    extended = stack.extended
    causes = tuple(library.candidates[c] for c in chosen)
    theta, on = extended.theta.copy(), extended.on.copy()
    used, fitted = screening.coefficients(chosen)
    unknowns, start = [], []
    slots = extended.servo.slots()
    for column, value in zip(used, fitted, strict=True):
        if column < len(screening.nuisance) and screening.labels[column] in slots:
            path = screening.labels[column]
            theta[slots[path].start] += value
            least, most = extended.servo.tolerance[path]
            unknowns.append(Unknown(path, 0, least, most))
            start.append(theta[slots[path].start])
    for number, cause in zip(chosen, causes, strict=True):
        theta, on = stack.with_shapes(cause, theta, on)
        values = fitted[np.isin(used, screening.members[number])]
        for path, element, value in zip(cause.paths, cause.elements, values, strict=True):
            slot = extended.slot(path, element)
            theta[slot] += value
            low, high = screening.room(cause, path, element)
            unknowns.append(Unknown(path, element, low, high))
            start.append(theta[slot])
        for path, value in cause.shapes:
            if screening.shapes.is_place(path):
                unknowns.append(Unknown(path, 0, *screening.shapes.around(path, value)))
                start.append(value)
            elif extended.declaration(path).grid and not path.endswith('.order'):
                low, high = screening.shapes.within(path)
                unknowns.append(Unknown(path, 0, max(low, 0.3 * value), min(high, 3.0 * value),
                                        True))
                start.append(value)
    if near is not None:
        known = near.values(extended)
        start = [known.get((u.path, u.element), value)
                 for u, value in zip(unknowns, start, strict=True)]
    return _polished(screening, causes, theta, on, unknowns, np.array(start))


def _polished(screening: Screening, causes, theta, on, unknowns, start) -> Explanation:
    if not unknowns:
        return Explanation(causes, theta, on, (), np.zeros(0))
    logarithmic = np.array([u.logarithmic for u in unknowns])
    scale = np.array([_scale(u, v) for u, v in zip(unknowns, start, strict=True)])

    def scaled(values):
        values = np.asarray(values, dtype=float)
        return np.where(logarithmic, np.log(np.where(logarithmic, values, 1.0)), values) / scale

    low, high = scaled([u.low for u in unknowns]), scaled([u.high for u in unknowns])
    problem = _Problem(screening, unknowns, theta, on, scale, (low, high))
    x = np.clip(scaled(start), low, high)
    best, left, slopes = gauss_newton(problem.left, problem.slopes, x, low, high)
    inside = np.minimum(best - low, high - best) > 1e-3 * np.maximum(np.abs(best), 1e-9)
    std = _spread(slopes, left, screening.blocks) * scale
    # what its bound holds does not spread, and what trades with it no more
    std[inside] = _spread(slopes[:, inside], left, screening.blocks) * scale[inside]
    values = best * scale
    std = np.where(logarithmic, std * np.exp(np.where(logarithmic, values, 0.0)), std)
    bound = tuple(u.path for u, v, a, b in zip(unknowns, best, low, high, strict=True)
                  if min(v - a, b - v) < 1e-3 * max(abs(v), 1e-9) and not u.logarithmic)
    return Explanation(causes, problem.place(best), on, tuple(unknowns), std, bound)


class _Problem:
    """What is left of the balances as a function of scaled unknowns, with its slopes."""

    def __init__(self, screening: Screening, unknowns, theta, on, scale, bounds) -> None:
        self._stack, self._on, self._theta, self._scale = screening.stack, on, theta, scale
        self._weight = screening.weight
        # the linear nuisances that are no parameters of a servo: zeros and instants of sampling
        values = self._stack.extended.servo.values
        free = np.array([n for n in screening.nuisance if screening.labels[n] not in values],
                        dtype=int)
        self._nuisance = np.asfortranarray(screening.columns(free) * self._weight[:, None])
        self._products = self._nuisance.T @ self._nuisance
        self._low, self._high = screening.low[free], screening.high[free]
        self._bounds = bounds
        self._unknowns = unknowns
        self._slots = [self._stack.extended.slot(u.path, u.element) for u in unknowns]
        self._moves: list[tuple[str, ...] | None] = [None] * len(unknowns)
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    def place(self, x: np.ndarray) -> np.ndarray:
        """Return the values of the servo at some scaled unknowns."""
        moved = self._theta.copy()
        for slot, one, value in zip(self._slots, self._unknowns, x * self._scale, strict=True):
            value = np.exp(value) if one.logarithmic else value
            moved[slot] = min(max(value, one.low), one.high)  # but for rounding it is inside
        return moved

    def left(self, x: np.ndarray) -> np.ndarray:
        """Return what is left at some unknowns with the nuisances fitted."""
        self._last = x.copy(), self._stack.at(self.place(x), self._on)
        return self._less(self._last[1])

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """
        Return the change of what is left for one unit of each unknown, by differences.

        An unknown is asked only of the balances that it moved when it first moved any.
        """
        if self._last is None or not np.array_equal(x, self._last[0]):
            self.left(x)
        whole, here = self._last[1], self._less(self._last[1])
        table = np.empty((len(here), len(x)))
        low, high = self._bounds
        for i in range(len(x)):
            there = x.copy()
            step = 1e-3 * (x[i] or 1.0)
            there[i] += step if low[i] <= x[i] + step <= high[i] else -step
            moved = self._stack.at(self.place(there), self._on, self._moves[i], whole)
            if not self._moves[i]:
                changed = np.unique(self._stack.balance[moved != whole])
                self._moves[i] = tuple(BALANCES[b] for b in changed) or None
            table[:, i] = (self._less(moved) - here) / (there[i] - x[i])
        return table

    def _less(self, residual: np.ndarray) -> np.ndarray:
        residual = residual * self._weight
        moved = bounded(self._products, residual @ self._nuisance, self._low, self._high)
        return np.clip(residual + self._nuisance @ moved, -60.0, 60.0)


def _scale(unknown: Unknown, value: float) -> float:
    if unknown.logarithmic:
        return 1.0
    if abs(value) > 1e-12:
        return abs(value)
    return min(abs(unknown.high - unknown.low), 1.0)


def _spread(jacobian: np.ndarray, residual: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Standard deviations by the scatter of block scores: blind to correlation inside a block."""
    size = jacobian.shape[1]
    weight = np.sqrt((jacobian**2).sum(axis=0)) + 1e-300
    table = jacobian / weight
    bread = np.linalg.pinv(table.T @ table)
    scores = np.zeros((blocks.max() + 1, size))
    np.add.at(scores, blocks, table * residual[:, None])
    many = len(scores)
    meat = scores.T @ scores * many / max(many - size, 1)
    return np.sqrt(np.maximum(np.diag(bread @ meat @ bread), 0.0)) / weight
