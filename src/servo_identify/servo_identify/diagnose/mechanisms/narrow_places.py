"""Where a curve over the place of a shaft bends: detents and tight spots are narrow."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..decisions import CALIBRATED
from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import Motion
from .builder import Builder
from .orders import hats

FINEST = 129  # places between which a curve may bend
MOST = 48  # of them that one curve takes
SINGULAR = 1e-9  # share of a column that the others leave, from which on it is theirs
UNDER = ((-np.sqrt(1.5), 1.0 / 6.0), (0.0, 2.0 / 3.0), (np.sqrt(1.5), 1.0 / 6.0))
"""
Spacings from its centre, and weights there, that stand for a test function.

Gauss's rule of three for its deviation, sqrt(1/2) spacings: it is six boxes of one spacing.
"""


def narrow_places(builder: Builder, residual: np.ndarray, equation: str, odd: bool
                  ) -> np.ndarray | None:
    """
    Return the places (n,) of the load, rad, where a curve through a residual has to bend.

    ``residual`` (samples,) is what an ``equation`` leaves; the curve is ``odd`` where it changes
    its sign with the direction. One bend after the other is taken, that of the most gain first,
    as many as are worth their number. None where the equation is not off, and where fewer than
    two bends are.
    """
    samples = builder.samples
    rows = samples.rows(equation)
    blocks = len(np.unique(samples.block[rows]))
    at, left = samples.of_motion(equation, 'load_angle'), builder.apart(residual)[rows]
    if blocks < 2 or not np.ptp(at) > 0.0 or np.mean(left**2) <= CALIBRATED:
        return None
    grid = np.linspace(at.min(), at.max(), FINEST)
    table = np.zeros((len(rows), FINEST))
    for spacings, weight in UNDER:
        there = hats(samples.along(equation, _away('load_angle', spacings)), grid)
        if odd:
            there *= samples.along(equation, _away('direction', spacings))[:, None]
        table[rows] += weight * there / samples.scale[rows, None]
    bends = np.column_stack((np.ones(FINEST), np.maximum(grid[:, None] - grid[:-1], 0.0)))
    chosen = _chosen(builder.apart(table)[rows] @ bends, left, blocks)
    places = np.unique(np.concatenate((grid[[0, -1]], grid[[k - 1 for k in chosen if k > 1]])))
    return places if len(places) > 3 else None


def _away(name: str, spacings: float) -> Callable[[EquationErrors, Motion], np.ndarray]:
    """Return what gives a column of a motion so many spacings of its test function later."""
    def of(one: EquationErrors, motion: Motion) -> np.ndarray:
        series = motion[name]
        later = np.arange(len(series)) + round(spacings * motion.test.spacing)
        return series[np.clip(later, 0, len(series) - 1)]

    return of


def _chosen(columns: np.ndarray, left: np.ndarray, blocks: int) -> list[int]:
    """
    Return which columns (samples, n) are worth a number each; level and slope always are.

    One bend alone may do little where three make a detent: of the path that takes the best column
    each time, the part is returned that is likeliest for the numbers that it takes.
    Source: Chen, Billings, Luo: Int. J. Control 50(5), 1989, orthogonal least squares.
    """
    products, shared = columns.T @ columns, columns.T @ left
    floor, whole = CALIBRATED * len(left), float(left @ left)
    own, price = np.diag(products).copy(), 0.5 * np.log(blocks)
    chosen: list[int] = []
    costs: list[float] = []
    while len(chosen) < MOST:
        rest = np.diag(products)
        gains = np.where(rest > SINGULAR * own, shared**2 / np.maximum(rest, 1e-300), 0.0)
        best = len(chosen) if len(chosen) < 2 else int(np.argmax(gains))
        if gains[best] > 0.0:
            along = products[:, best] / products[best, best]
            shared = shared - along * shared[best]
            products = products - np.outer(along, products[best])
        whole -= float(gains[best])
        chosen.append(best)
        costs.append(0.5 * blocks * float(np.log(max(whole, floor))) + price * len(chosen))
    return chosen[:2 + int(np.argmin(costs[1:]))]
