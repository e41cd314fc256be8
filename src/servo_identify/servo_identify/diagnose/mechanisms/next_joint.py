"""The weight of what a carried axis moves, by both angles, where that axis is recorded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from servo_twin.physics.servo import Servo

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import EXTERNAL, Hypothesis, Mechanism
from .orders import waves

WAYS = {1.0: 'sum', -1.0: 'difference'}
"""How the angle of a carried axis may be counted: with that of the load, or against it."""


def next_joint(builder: Builder) -> Iterator[Hypothesis]:
    r"""
    Yield the hypotheses of the weight of the next joint, where ``coupled_position`` was recorded.

    .. math:: \tau = a\cos(\theta \pm \theta_c) + b\sin(\theta \pm \theta_c)
    """
    moves = any(np.ptp(one.motion['coupled_angle']) > 0.0 for one in builder.samples.errors)
    if not moves or not builder.turns('load_angle'):
        return
    mechanism = Mechanism(EXTERNAL, 'torque', 'load', ('coupled angle',), 'even')
    for way, words in WAYS.items():
        one = builder.hypothesis(mechanism, builder.place('load_torque', partial(_pull, way)),
                                 [0, 0], detail={'told': partial(_told, words)})
        if one:
            yield one


def _pull(way: float, one: EquationErrors) -> np.ndarray:
    return waves(one.motion['load_angle'] + way * one.motion['coupled_angle'], (1.0,))


def _told(words: str, knots: Sequence[float], amplitudes: np.ndarray, servo: Servo) -> str:
    """Return the amplitude of the torque, in words."""
    size = float(np.hypot(*amplitudes))
    return f'{size:.3g} {servo.reads("N m", "load")}, once a turn of the {words} of both angles'
