r"""
A transmission that slips: a belt or a rope that creeps, a friction wheel, a clutch.

What slips is lost for good, so that the two encoders part as the machine goes on. A belt loses a
share of each turn that grows with its torque; a clutch loses nothing up to its torque, and nearly
all beyond.

.. math:: \dot w = |\omega|\,\mathrm{sgn}(T) \sum_k a_k \max(|T| - T_k, 0), \quad a_k \ge 0
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from servo_twin.physics.servo import Servo

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import bridged
from .builder import Builder
from .hypothesis import Form, Hypothesis, Mechanism, SLIP

HOLDS = (0.0, 0.3, 0.6, 0.8, 0.9, 0.95)
"""Shares of the largest torque up to which nothing slips."""


def slip(builder: Builder, top: float) -> Hypothesis | None:
    """Return the hypothesis of a transmission that slips; ``top`` is its largest torque, N m."""
    mechanism = Mechanism(SLIP, 'mesh', 'mesh', ('load', 'speed'), 'odd', memory=True)
    ratio = builder.samples.servo.numbers['mechanism.ratio']

    def share(torque: np.ndarray) -> np.ndarray:
        beyond = [np.maximum(torque / top - least, 0.0) / (1.0 - least) for least in HOLDS]
        return np.column_stack(beyond)

    def torsion(one: EquationErrors) -> np.ndarray:
        torque, period = one.transmitted(), one.measured.period
        turned = period * np.abs(bridged(one.motion['motor_speed'])) / ratio
        lost = (turned * np.sign(torque))[:, None] * share(np.abs(torque))
        return np.cumsum(np.nan_to_num(lost), axis=0)

    form = Form('load', 'N m', 'rad/rad', lambda one: np.abs(one.transmitted()), share)
    return builder.hypothesis(mechanism, builder.place('torsion', torsion), [1] * len(HOLDS),
                              tuple(top * least for least in HOLDS), form=form,
                              detail={'told': _told, 'top': top})


def _told(knots: Sequence[float], amplitudes: np.ndarray, servo: Servo) -> str:
    """Return what slips at the largest torque, of each turn, and from which torque on."""
    works = amplitudes > 0.02 * amplitudes.sum()
    least = min((knot for knot, at_work in zip(knots, works, strict=True) if at_work), default=0.0)
    begins = f', none up to {least:.3g} {servo.reads("N m", "load")}' if least else ''
    return f'{100.0 * amplitudes.sum():.2g} % of each turn at the largest torque{begins}'
