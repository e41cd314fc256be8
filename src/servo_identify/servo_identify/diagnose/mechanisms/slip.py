r"""
A transmission that slips: a belt or a rope that creeps, a friction wheel, a clutch.

What slips is lost for good, so that the two encoders part as the machine goes on. A belt loses a
share of each turn that grows with its torque; a clutch loses nothing up to its torque, and nearly
all beyond.

.. math:: \dot w = |\omega|\,\mathrm{sgn}(T) \sum_k a_k \max(|T| - T_k, 0), \quad a_k \ge 0
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from servo_twin.physics.servo import Servo

from ..decisions import WORTH
from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import bridged
from .builder import Builder
from .hypothesis import Form, Hypothesis, Mechanism, SLIP

HOLDS = (0.0, 0.3, 0.6, 0.8, 0.9, 0.95)
"""Shares of the largest torque up to which nothing slips."""

CLUTCH = 0.3  # share of the largest torque from which on what holds is a clutch rather than a belt
POINTS = 101


def slip(builder: Builder, top: float) -> Hypothesis | None:
    """Return the hypothesis of a transmission that slips; ``top`` is its largest torque, N m."""
    mechanism = Mechanism(SLIP, 'mesh', 'mesh', ('load', 'speed'), 'odd', memory=True)
    ratio = builder.samples.servo.numbers['mechanism.ratio']

    def share(torque: np.ndarray) -> np.ndarray:
        return _beyond(torque / top, HOLDS)

    def torsion(one: EquationErrors) -> np.ndarray:
        torque, period = one.transmitted(), one.measured.period
        turned = period * np.abs(bridged(one.motion['motor_speed'])) / ratio
        lost = (turned * np.sign(torque))[:, None] * share(np.abs(torque))
        return np.cumsum(np.nan_to_num(lost), axis=0)

    form = Form('load', 'N m', 'rad/rad', lambda one: np.abs(one.transmitted()), share)
    return builder.hypothesis(mechanism, builder.place('torsion', torsion), [1] * len(HOLDS),
                              tuple(top * least for least in HOLDS), form=form,
                              detail={'told': partial(_told, top)})


def _beyond(share: np.ndarray, holds: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return how far a torque, a share of the largest, is beyond each that holds, (n, holds)."""
    least = np.asarray(holds, dtype=float)
    beyond: np.ndarray = np.maximum(share[:, None] - least, 0.0) / (1.0 - least)
    return beyond


def _told(top: float, knots: Sequence[float], amplitudes: np.ndarray, servo: Servo) -> str:
    """Return what slips of each turn at the largest torque, and up to which torque hardly any."""
    shares = np.linspace(0.0, 1.0, POINTS)
    slips = _beyond(shares, np.asarray(knots) / top) @ amplitudes
    begins = float(shares[int(np.argmax(slips > WORTH * slips[-1]))]) * top
    said = f'{min(100.0, 100.0 * slips[-1]):.3g} % of each turn at {top:.3g}'
    unit = servo.reads('N m', 'load')
    early = begins > CLUTCH * top
    return f'{said} {unit}' + (f', hardly any up to {begins:.3g} {unit}' if early else '')
