"""Friction that builds up over a long travel after each reversal, as a bundle of hoses drags."""

from __future__ import annotations

import numpy as np

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import Hypothesis, Mechanism
from .memory import dahl_operator
from .shape_search import SHAPES

SHORTEST, LONGEST = 0.01, 0.5
"""
Shares of the travel over which it may build up.

Over less, elements in parallel tell it as well; what never does is a spring.
"""


def dahl(builder: Builder, site: str, residual: np.ndarray) -> Hypothesis | None:
    """
    Return Dahl's friction at a shaft; ``residual`` (samples,) tells its travel.

    Elements in parallel open a loop over twice the travel that a first motion takes, and Dahl's
    over as much.
    """
    name = f'{site}_angle'
    low, high = (share * builder.scales.stroke(name) for share in (SHORTEST, LONGEST))
    if not builder.scales.finest(site) < high:
        return None

    def torque(one: EquationErrors, travel: float) -> np.ndarray:
        return -dahl_operator(one.motion[name], travel)[:, None]

    travel, columns = builder.best_columns(low, high, f'{site}_torque', torque, residual)
    mechanism = Mechanism('presliding_friction', 'friction', site, ('travel since reversal',),
                          'odd', memory=True)
    return builder.hypothesis(mechanism, columns, [1], (travel,), tried=SHAPES,
                              detail={'law': 'dahl_friction'})
