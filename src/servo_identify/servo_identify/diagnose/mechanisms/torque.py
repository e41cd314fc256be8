"""Torques that depend on an angle, on the current or on acceleration, and what swings behind."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.optimize import minimize

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import bridged
from .builder import Builder
from .hypothesis import ANY, Form, Hypothesis, Mechanism, Series
from .memory import relaxation, resonator
from .orders import periodic, waves
from .shaft_friction import shaft_equation
from .shape_search import SHAPES, taken

HANGING = ((1.0,), (1.0, 2.0, 3.0))  # orders of a weight, and of one that is balanced or linked
KNEES = (0.03, 0.1, 0.2, 0.4, 0.6, 0.8)  # shares of the largest current, past which torque is lost
STOPS = (0.04, 0.08, 0.15, 0.3)  # shares of the travel within which an end of it may push back
FREQUENCIES, DAMPINGS = 48, (0.005, 0.02, 0.08, 0.3)  # of a payload
REFINED, SIMPLEX = 60, ((0.0, 0.0), (0.05, 0.0), (0.0, 0.5))  # search about the best of the grid
PERIODS = 3.0  # of the slowest swing that a recording must hold
BAND = 0.45  # of the sampling rate of the test function, below which it may swing


def torque_of(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """
    Yield the hypotheses of torques; ``residual`` (samples,) tells orders.

    What repeats as seldom as a weight on a linkage does hangs at the load: no motor has as few
    teeth.
    """
    equation = shaft_equation(builder, 'motor')
    ratio = builder.samples.servo.numbers['mechanism.ratio']
    yield from periodic(builder, Mechanism('cogging', 'torque', 'motor', ('angle',), 'even'),
                        residual, equation, 'motor_angle', 'motor_torque', '',
                        lambda one: np.ones(len(one.motion.rows)), 'N m',
                        lowest=int(max(HANGING[-1]) / ratio) + 1)
    yield from periodic(
        builder, Mechanism('torque_ripple', 'torque', 'motor', ('current', 'angle'), 'even'),
        residual, equation, 'motor_angle', 'motor_torque', 'current',
        builder.rippling, 'N m/A')
    yield from filter(None, (_constant(builder),
                             *(_gravity(builder, orders) for orders in HANGING),
                             *(_spring(builder, bends) for bends in (False, True)),
                             _relaxing(builder, residual), _saturation(builder)))
    yield from _payload(builder, residual)


def _constant(builder: Builder) -> Hypothesis | None:
    """A weight on a slope: a torque that is always there."""
    mechanism = Mechanism('constant_torque', 'torque', 'load', ('angle',), 'even')
    form = Form('angle', 'rad', 'N m', lambda one: one.motion['load_angle'],
                lambda x: np.ones((len(x), 1)))
    return builder.hypothesis(mechanism, builder.of_form('load_torque', form), [0], form=form)


def _gravity(builder: Builder, orders: tuple[float, ...]) -> Hypothesis | None:
    """
    What hangs at a load that turns, by itself or beside what balances it or links it to the shaft.

    What moves straight weighs the same everywhere: :func:`_constant`.
    """
    if not builder.turns('load_angle'):
        return None
    mechanism = Mechanism('gravity', 'torque', 'load', ('angle',), 'even')
    form = Form('angle', 'rad', 'N m', lambda one: one.motion['load_angle'],
                lambda x: waves(x, orders))
    knots = tuple(order for order in orders for _ in range(2))
    return builder.hypothesis(mechanism, builder.of_form('load_torque', form), [0] * len(knots),
                              knots, form=form)


def _spring(builder: Builder, bends: bool) -> Hypothesis | None:
    """
    A spring at the load: in proportion to its stretch, or one that also bends over.

    On a linear axis it may push more the further it goes, as a gas spring does; where the load
    turns, a weight does so.
    """
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
                              [0, 1, *[1] * bends * (1 + 2 * len(STOPS))], form=form,
                              either=not builder.turns('load_angle'))


def _relaxing(builder: Builder, residual: np.ndarray) -> Hypothesis | None:
    """A spring at the load whose force fades: air behind a throttle, rubber."""
    low, high = builder.scales.fading
    if not high > low:
        return None

    def torque(one: EquationErrors, time: float) -> np.ndarray:
        left = relaxation(bridged(one.angles()[1]), one.measured.period, time)
        return -one.inner(left)[:, None]

    time, columns = builder.best_columns(low, high, 'load_torque', torque, residual)
    mechanism = Mechanism('relaxing_spring', 'torque', 'load', ('angle',), 'odd', memory=True)
    return builder.hypothesis(mechanism, columns, [1], (time,), tried=SHAPES)


def _saturation(builder: Builder) -> Hypothesis | None:
    top = builder.scales.current
    if not top > 0.0:
        return None
    mechanism = Mechanism('torque_saturation', 'torque', 'motor', ('current',), 'odd')

    def torque(current: np.ndarray) -> np.ndarray:
        size = np.abs(current) / top
        lost = [size**3, *(np.maximum(size - knee, 0.0) for knee in KNEES)]
        return -np.sign(current)[:, None] * np.column_stack(lost)

    form = Form('current', 'A', 'N m', lambda one: one.saturating_current, torque)
    return builder.hypothesis(mechanism, builder.of_form('motor_torque', form),
                              [1] * (1 + len(KNEES)), (0.0, *KNEES), either=True, form=form)


def _payload(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """
    A mass on a spring, beside the load of the file or a part of it: frequency and damping.

    Some of the load stays on the shaft. Were all of it on the spring, that would be the
    transmission's.
    """
    mechanism = Mechanism('payload_resonance', 'torque', 'load', ('acceleration',), 'odd',
                          memory=True)
    rate = max(1.0 / (one.motion.test.spacing * one.measured.period)
               for one in builder.samples.errors)
    low, high = PERIODS / builder.scales.duration, BAND * rate
    if not high > low:
        return
    pushed = {id(one): shaken(one) for one in builder.samples.errors}
    left = builder.apart(residual)

    def beside(torque: Series) -> np.ndarray:
        return builder.apart(builder.place('load_torque', torque).table)

    fixed = beside(lambda one: -pushed[id(one)][:, None])

    def gain(table: np.ndarray) -> np.ndarray:
        return taken(table, left)

    def swinging(tones: np.ndarray, damping: float) -> np.ndarray:
        return beside(lambda one: -np.column_stack([resonator(
            pushed[id(one)], one.measured.period, tone, damping) for tone in tones]))

    whole = builder.samples.servo.numbers['mechanism.load_inertia']
    least, _ = builder.samples.servo.tolerance.get('mechanism.load_inertia', (whole, whole))
    tones = np.geomspace(low, high, FREQUENCIES)
    grid = [(damping, swinging(tones, damping)) for damping in DAMPINGS]
    for part in (False, True):
        known = fixed if part else 0.0 * fixed
        _, damping, tone = max((float(np.max(each)), damping, tones[int(np.argmax(each))])
                               for damping, table in grid for each in [gain(table - known)])
        best = minimize(
            lambda q, known=known: -gain(swinging(np.exp(q[:1]), np.exp(q[1])) - known)[0],
            np.log((tone, damping)), method='Nelder-Mead',
            bounds=np.log(((low, high), (DAMPINGS[0], DAMPINGS[-1]))),
            options={'maxfev': REFINED, 'initial_simplex': np.log((tone, damping)) + SIMPLEX})
        tone, damping = map(float, np.exp(best.x))

        def torque(one: EquationErrors, tone: float = tone, damping: float = damping,
                   part: bool = part) -> np.ndarray:
            moved = shaken(one)
            hung = resonator(moved, one.measured.period, tone, damping)
            return (part * moved - hung)[:, None]

        one = builder.hypothesis(
            mechanism, builder.place('load_torque', torque), [1], (tone,),
            tried=FREQUENCIES * len(DAMPINGS), room=(0.0, least) if part else ANY,
            detail={'damping': damping} | ({'law': 'payload_resonance'} if part else {}))
        if one:
            yield one


def shaken(one: EquationErrors) -> np.ndarray:
    """
    Acceleration of the load, rad/s2 at the inner samples, that no test function has smoothed.

    What swings is smoothed with the rest of the equation, once: twice would be much where it
    swings nearly as fast as the test function passes.
    """
    raw = np.gradient(np.gradient(bridged(one.angles()[1]), one.measured.period),
                      one.measured.period)
    return one.inner(raw)
