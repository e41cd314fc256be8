"""Friction that has a peak over speed, which no sum of curves that rise or fall holds to."""

from __future__ import annotations

import numpy as np

from .builder import Builder
from .hypothesis import Form, Hypothesis, Mechanism
from .shaft_friction import over_speed
from .shape_search import SHAPES

PEAKS = (0.05, 0.7)  # shares of the top speed between which the peak must lie to be seen


def eddy_brake(builder: Builder, site: str, residual: np.ndarray) -> Hypothesis | None:
    """Return the drag of eddy currents at a shaft; ``residual`` (samples,) tells its peak."""
    top = builder.scales.top(f'{site}_speed')
    if not top > 0.0:
        return None

    def form(critical: float) -> Form:
        def drag(speed: np.ndarray) -> np.ndarray:
            share = speed / critical
            return (2.0 * share / (1.0 + share**2))[:, None]

        return over_speed(site, drag)

    def column(critical: float) -> np.ndarray:
        peaked = form(critical)
        return builder.resisting(site, lambda one: peaked.shape(peaked.of(one))).table[:, 0]

    low, high = PEAKS
    critical = builder.best_shape(low * top, high * top, column, residual)
    return builder.resistance(Mechanism('eddy_brake', 'friction', site, ('speed',), 'odd'),
                              form(critical), [1], (critical,), tried=SHAPES)
