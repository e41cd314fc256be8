"""What the axis that this one carries does to it, where its angle is recorded beside."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from servo_twin.physics.servo import Servo

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import bridged
from .builder import Builder
from .hypothesis import EXTERNAL, Form, Hypothesis, Mechanism, Series
from .orders import rises, waves

WAYS = {1.0: 'sum', -1.0: 'difference'}
"""How the angle of a carried axis may be counted: with that of the load, or against it."""
CARRIED = ((0.0, 1.0), (0.0, 2.0))
"""Orders of its angle by which the inertia varies: of an arm in its plane, of a tilted body."""
REACTION = (0.0, 1.0)
"""Orders of its angle by which its own acceleration is felt."""


def next_joint(builder: Builder) -> Iterator[Hypothesis]:
    r"""
    Yield the hypotheses of the next joint, where ``coupled_position`` was recorded.

    Its weight, how it changes the inertia that this axis turns, and what its own motion does:

    .. math:: \tau = a\cos(\theta \pm \theta_c) + b\sin(\theta \pm \theta_c)
              - \frac{d}{dt}\bigl(J(\theta_c)\,\dot\theta\bigr)
              - \frac{d}{dt}\bigl(C(\theta_c)\,\dot\theta_c\bigr)

    Source: Spong, Hutchinson, Vidyasagar: Robot Modeling and Control, 2006, planar elbow arm.
    """
    moves = any(np.ptp(one.motion['coupled_angle']) > 0.0 for one in builder.samples.errors)
    if not moves or not builder.turns('load_angle'):
        return
    yield from filter(None, (_inertia(builder, orders) for orders in CARRIED))
    weights = {words: partial(_pull, way) for way, words in WAYS.items()}
    for words, pull in weights.items():
        yield from filter(None, (
            _torque(builder, [pull], partial(_weighs, words)),
            _torque(builder, [pull, _reaction], partial(_both, words))))
    yield from filter(None, (_torque(builder, [_reaction], _reacts),))


def _torque(builder: Builder, several: Sequence[Series], told: object) -> Hypothesis | None:
    """A torque of the next joint, of one or two kinds."""
    mechanism = Mechanism(EXTERNAL, 'torque', 'load', ('coupled angle',), 'even')
    columns = builder.place('load_torque',
                            lambda one: np.column_stack([of(one) for of in several]))
    return builder.hypothesis(mechanism, columns, [0] * columns.size, range(columns.size),
                              detail={'told': told})


def _pull(way: float, one: EquationErrors) -> np.ndarray:
    return waves(one.motion['load_angle'] + way * one.motion['coupled_angle'], (1.0,))


def _rates(one: EquationErrors) -> tuple[np.ndarray, np.ndarray]:
    """Return speed and acceleration of the next joint at the inner samples, rad/s and rad/s2."""
    angle = bridged(one.measured.recording['coupled_position'])
    speed, rate = (np.nan_to_num(one.motion.test.smooth(angle, order)) for order in (1, 2))
    return speed, rate


def _reaction(one: EquationErrors) -> np.ndarray:
    """Return the torque of its own motion for 1 kg m2 of each order, without the sine of none."""
    angle, (speed, rate) = one.motion['coupled_angle'], _rates(one)
    table = -(rate[:, None] * waves(angle, REACTION)
              + (speed**2)[:, None] * rises(angle, REACTION))
    return np.delete(table, 1, axis=1)


def _inertia(builder: Builder, orders: Sequence[float]) -> Hypothesis | None:
    """An inertia of the load that the next joint changes as it turns."""
    def torque(one: EquationErrors) -> np.ndarray:
        angle, motion = one.motion['coupled_angle'], one.motion
        return -(motion['load_acceleration'][:, None] * waves(angle, orders)
                 + (motion['load_speed'] * _rates(one)[0])[:, None] * rises(angle, orders))

    mechanism = Mechanism('parameter:load_inertia', 'inertia', 'load',
                          ('acceleration', 'coupled angle'), 'odd')
    form = Form('coupled angle', 'rad', 'kg m2', lambda one: one.motion['coupled_angle'],
                lambda x: waves(x, orders))
    return builder.hypothesis(mechanism, builder.place('load_torque', torque),
                              [0] * 2 * len(orders), tuple(np.repeat(orders, 2)), form=form,
                              detail={'law': 'coupled_inertia', 'of': 'mechanism.load_inertia',
                                      'size': _turns})


def _turns(knots: Sequence[float], amplitudes: np.ndarray, servo: Servo) -> str:
    """Return between what the inertia lies, in words."""
    mean = servo.numbers['mechanism.load_inertia'] + float(amplitudes[0])
    varies = float(np.hypot(*amplitudes[-2:]))
    return (f'{mean - varies:.3g} to {mean + varies:.3g} {servo.reads("kg m2", "load")} over the '
            'angle of the next joint')


def _weighs(words: str, knots: Sequence[int], amplitudes: np.ndarray, servo: Servo) -> str:
    """Return the amplitude of the weight, in words."""
    size = float(np.hypot(*amplitudes[:2]))
    return f'{size:.3g} {servo.reads("N m", "load")}, once a turn of the {words} of both angles'


def _reacts(knots: Sequence[int], amplitudes: np.ndarray, servo: Servo) -> str:
    """Return how its acceleration is felt, in words."""
    mean, varies = float(amplitudes[0]), float(np.hypot(*amplitudes[1:]))
    return (f'{mean - varies:.3g} to {mean + varies:.3g} {servo.reads("kg m2", "load")} times the '
            'acceleration of the next joint')


def _both(words: str, knots: Sequence[int], amplitudes: np.ndarray, servo: Servo) -> str:
    return (f'{_weighs(words, knots, amplitudes[:2], servo)}, and '
            f'{_reacts(knots, amplitudes[2:], servo)}')
