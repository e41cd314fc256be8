"""Torques that depend on an angle, on the current or on acceleration, and what swings behind."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .friction import shaft_equation
from .hypothesis import Columns, Form, Hypothesis, Mechanism
from .memory import resonator
from .orders import periodic, waves

HANGING = ((1.0,), (1.0, 2.0, 3.0))  # orders of a weight, and of one that is balanced or linked
KNEES = (0.03, 0.1, 0.2, 0.4, 0.6, 0.8)  # shares of the largest current, past which torque is lost
STOPS = (0.15, 0.3)  # shares of the travel within which an end of it may push back
FREQUENCIES, DAMPINGS = 40, (0.02, 0.08, 0.3)  # of a payload
REFINED, NEAR = 4, 5  # rounds of search for a frequency, and values in each after the first
BAND = (0.02, 0.45)  # of the sampling rate of the test function, between which it may swing


def torque_of(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """Yield the hypotheses of torques; ``residual`` (samples,) tells orders."""
    equation = shaft_equation(builder, 'motor')
    yield from periodic(builder, Mechanism('cogging', 'torque', 'motor', ('angle',), 'even'),
                        residual, equation, 'motor_angle', 'motor_torque', '',
                        lambda one: np.ones(len(one.motion.rows)), 'N m')
    yield from periodic(
        builder, Mechanism('torque_ripple', 'torque', 'motor', ('current', 'angle'), 'even'),
        residual, equation, 'motor_angle', 'motor_torque', 'current',
        lambda one: one.driving_current, 'N m/A')
    yield from filter(None, (*(_gravity(builder, orders) for orders in HANGING),
                             *(_spring(builder, bends) for bends in (False, True)),
                             _saturation(builder)))
    yield from _payload(builder, residual)


def _gravity(builder: Builder, orders: tuple[float, ...]) -> Hypothesis | None:
    """What hangs at the load, by itself or beside what balances it or links it to the shaft."""
    mechanism = Mechanism('gravity', 'torque', 'load', ('angle',), 'even')
    form = Form('angle', 'rad', 'N m', lambda one: one.motion['load_angle'],
                lambda x: waves(x, orders))
    knots = tuple(order for order in orders for _ in range(2))
    return builder.hypothesis(mechanism, builder.of_form('load_torque', form), [0] * len(knots),
                              knots, form=form)


def _spring(builder: Builder, bends: bool) -> Hypothesis | None:
    """A spring at the load: in proportion to its stretch, or one that also bends over."""
    low, high = builder.scales.travel('load_angle')
    if not high > low:
        return None
    mechanism = Mechanism('spring_load', 'torque', 'load', ('angle',), 'even')
    middle, half = 0.5 * (low + high), 0.5 * (high - low)

    def torque(angle: np.ndarray) -> np.ndarray:
        place = (angle - middle) / half
        line = np.column_stack((np.ones(len(place)), -place))
        if not bends:
            return line
        ends = [np.maximum(way * place - (1.0 - 2.0 * share), 0.0) * -way
                for share in STOPS for way in (1.0, -1.0)]
        return np.column_stack((line, -place**3, *ends))

    form = Form('angle', 'rad', 'N m', lambda one: one.motion['load_angle'], torque)
    return builder.hypothesis(mechanism, builder.of_form('load_torque', form),
                              [0, 1, *[1] * bends * (1 + 2 * len(STOPS))], form=form)


def _saturation(builder: Builder) -> Hypothesis | None:
    top = builder.scales.current
    if not top > 0.0:
        return None
    mechanism = Mechanism('torque_saturation', 'torque', 'motor', ('current',), 'odd')

    def torque(current: np.ndarray) -> np.ndarray:
        size = np.abs(current) / top
        lost = [size**3, *(np.maximum(size - knee, 0.0) for knee in KNEES)]
        return -np.sign(current)[:, None] * np.column_stack(lost)

    form = Form('current', 'A', 'N m', lambda one: one.driving_current, torque)
    return builder.hypothesis(mechanism, builder.of_form('motor_torque', form),
                              [1] * (1 + len(KNEES)), (0.0, *KNEES), either=True, form=form)


def _payload(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """A mass on a spring: its frequency found on a grid, then between its neighbours."""
    mechanism = Mechanism('payload_resonance', 'torque', 'load', ('acceleration',), 'odd',
                          memory=True)
    rate = max(1.0 / (one.motion.test.spacing * one.measured.period)
               for one in builder.samples.errors)
    low, high = max(BAND[0] * rate, 2.0 / builder.scales.duration), BAND[1] * rate
    if not high > low:
        return

    def columns(tones: np.ndarray, damping: float) -> Columns:
        def torque(one: EquationErrors) -> np.ndarray:
            test, ratio = one.motion.test, one.servo.values['mechanism.ratio']
            has = one.measured.channels
            angle = one.angles()[1] if 'load_position' in has else one.angles()[0] / ratio
            pushed = test.smooth(np.nan_to_num(angle), 2)
            return -np.column_stack([resonator(pushed, one.measured.period, tone, damping)
                                     for tone in tones])
        return builder.place('load_torque', torque)

    for damping in DAMPINGS:
        tones = np.geomspace(low, high, FREQUENCIES)
        for _ in range(REFINED):
            several = columns(tones, damping)
            square = np.maximum((several.table**2).sum(axis=0), 1e-300)
            gain = np.minimum(several.table.T @ residual, 0.0) ** 2 / square
            best = int(np.argmax(gain))
            found, column = float(tones[best]), several.only(np.array([best]))
            apart = (tones[1] / tones[0]) ** 0.75
            tones = np.geomspace(found / apart, found * apart, NEAR)
        one = builder.hypothesis(mechanism, column, [1], (found,),
                                 tried=FREQUENCIES * len(DAMPINGS), detail={'damping': damping})
        if one:
            yield one
