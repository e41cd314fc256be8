"""A clearance where nothing says the torque: the load waits while the motor passes it."""

from __future__ import annotations

import numpy as np

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import Hypothesis, Mechanism
from .memory import stop_operator
from .shape_search import SHAPES

TAKEN_UP = (1e-4, 0.5)  # shares of the travel over which a clearance may be taken up


def as_gap(builder: Builder) -> dict[str, str]:
    """Return which law of the twin a clearance is: a rigid transmission has no gap."""
    return {} if builder.samples.servo.mechanism.compliant else {'law': 'lost_motion'}


def lost_motion(builder: Builder, residual: np.ndarray) -> Hypothesis | None:
    """
    Return a clearance by the travel of the motor, for two encoders alone; None where none moves.

    The load stays while the motor passes it. Over how much of the motor's travel it is taken up is
    sought, since it ends softly where the load creeps along. ``residual`` (samples,) tells it.
    """
    stroke = builder.scales.stroke('load_angle')
    if not stroke > 0.0:
        return None
    ratio = builder.samples.servo.numbers['mechanism.ratio']

    def torsion(one: EquationErrors, travel: float) -> np.ndarray:
        turned = one.motion['motor_angle'] / ratio
        return 0.5 * stop_operator(turned, 0.5 * travel)[:, None]

    travel, columns = builder.best_columns(TAKEN_UP[0] * stroke, TAKEN_UP[1] * stroke, 'torsion',
                                           torsion, residual)
    mechanism = Mechanism('backlash', 'clearance', 'mesh', ('travel',), 'odd', memory=True)
    return builder.hypothesis(mechanism, columns, [1], (travel,), tried=SHAPES,
                              detail=as_gap(builder))
