"""What a transmission remembers: loops that close after each reversal, and creep in time."""

from __future__ import annotations

import numpy as np

from ..decisions import FORM
from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import bridged
from .builder import Builder
from .hypothesis import Hypothesis, Mechanism
from .memory import dahl_operator, LOOPS, relaxation, stop_operator
from .shape_search import SHAPES

_LOOPS = Mechanism('hysteresis', 'mesh', 'mesh', ('load',), 'odd', memory=True)


def hysteresis(builder: Builder, top: float) -> Hypothesis | None:
    """Loops of the angle that is lost over the torque; ``top`` is the largest torque, N m."""

    def torsion(one: EquationErrors) -> np.ndarray:
        torque = one.transmitted()
        return -np.column_stack([stop_operator(torque, share * top) for share in LOOPS])

    stiffness = builder.samples.servo.numbers.get('mechanism.stiffness', 1.0)
    return builder.hypothesis(_LOOPS, builder.place('torsion', torsion), [1] * len(LOOPS),
                              tuple(s * top for s in LOOPS), detail={'stiffness': stiffness})


def rounded_loops(builder: Builder, top: float, residual: np.ndarray) -> Hypothesis | None:
    """
    Loops that bend over gradually after each reversal, so that small ones wander (Dahl).

    Elements that slip close every small loop where it began, and leave most of this one.
    """
    def torsion(one: EquationErrors, width: float) -> np.ndarray:
        return -dahl_operator(bridged(one.transmitted()), width)[:, None]

    width, columns = builder.best_columns(LOOPS[0] * top, LOOPS[-1] * top, 'torsion', torsion,
                                          residual)
    stiffness = builder.samples.servo.numbers['mechanism.stiffness']
    return builder.hypothesis(_LOOPS, columns, [1], (width,), tried=SHAPES,
                              detail={'law': 'dahl_hysteresis', 'stiffness': stiffness})


def creep(builder: Builder, residual: np.ndarray) -> Hypothesis | None:
    r"""
    A spring in series with a damper, beside the stiffness K of the transmission.

    .. math:: \frac{w}{T} = \frac1K - a\,\frac{s t}{1 + s t}

    Under a torque that changes quickly less of the angle is lost, by ``a``. ``t`` is the time in
    which the torsion creeps on under a torque that stays; under a torsion that stays the torque
    fades sooner, in t (1 - K a). Stiffness and damping within their tolerance would make up for a
    part of it: the time is sought beside them.
    """
    low, high = builder.scales.fading
    if not high > low:
        return None

    def torsion(one: EquationErrors, time: float) -> np.ndarray:
        return -relaxation(bridged(one.transmitted()), one.measured.period, time)[:, None]

    time, columns = builder.best_columns(low, high, 'torsion', torsion, residual)
    best = builder.apart(columns.table[:, 0])
    stiffness = builder.samples.servo.numbers['mechanism.stiffness']
    lost = -float(best @ builder.apart(residual)) / max(float(best @ best), 1e-300)
    fades = time * max(1.0 - stiffness * max(lost, 0.0), FORM)
    mechanism = Mechanism('viscoelasticity', 'mesh', 'mesh', ('load',), 'odd', memory=True)
    return builder.hypothesis(mechanism, columns, [1], (fades,), tried=SHAPES,
                              detail={'stiffness': stiffness})
