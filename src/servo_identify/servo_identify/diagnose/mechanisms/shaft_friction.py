"""
Friction: what resists the motion of a shaft, by speed, load, angle, time and travel.

Each mechanism is a family of curves, not a formula: friction that falls with speed, that grows
with it ever faster, that grows with the load. What a file lacks resists; where it has too much of
a law, the value of that is off.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import Form, Hypothesis, Mechanism
from .memory import stop_operator
from .orders import hats, periodic
from .shape_search import SHAPES

LOADS = (0.1, 0.3, 0.6)  # shares of the largest load at which the growth may bend
SPEEDS = (0.1, 0.3, 0.6)  # shares of the highest speed at which it may bend
POWERS = (1.5, 2.0, 3.0)  # of the speed, with which drag may grow
FADES = 6  # speeds within which friction may fall
TIMES = (0.015, 0.05, 0.15, 0.5, 1.5)  # shares of the longest recording in which it may settle
THINS = (0.5, 10.0)  # times by which grease may thin, as exponents, over the temperatures seen
STOPS = 10  # travels over which friction may build up, from what a sample resolves
PLACES = 12  # of a part of a turn at which friction has a value of its own


def friction_of(builder: Builder, site: str, residual: np.ndarray) -> Iterator[Hypothesis]:
    """Yield the hypotheses of friction at a shaft; ``residual`` (samples,) tells orders."""
    several = (_coulomb, _viscous, _stribeck, _drag, _driven_back, _presliding)
    yield from filter(None, (one(builder, site) for one in several))
    yield from filter(None, (_by_load(builder, site, carried) for carried in (False, True)))
    for viscous in (False, True):
        yield from filter(None, (_drift(builder, site, viscous),
                                 _thinning(builder, site, viscous, residual)))
    yield from _by_angle(builder, site, residual)


def shaft_equation(builder: Builder, site: str) -> str:
    """Equation in which a torque at a shaft shows."""
    return site if site in builder.samples.present else 'torque'


def speed_of(one: EquationErrors, site: str) -> np.ndarray:
    """Return how fast a shaft turns either way, rad/s at the inner samples."""
    return np.abs(one.motion[f'{site}_speed'])


def over_speed(site: str, shape: Callable[[np.ndarray], np.ndarray]) -> Form:
    return Form('speed', 'rad/s', 'N m', lambda one: speed_of(one, site), shape)


def _coulomb(builder: Builder, site: str) -> Hypothesis | None:
    mechanism = Mechanism('coulomb_friction', 'friction', site, ('direction',), 'odd')
    form = over_speed(site, lambda x: np.ones((len(x), 1)))
    return builder.resistance(mechanism, form, [1])


def _viscous(builder: Builder, site: str) -> Hypothesis | None:
    """Friction that grows with speed, in proportion or ever less."""
    top = builder.scales.top(f'{site}_speed')
    knots = (top, *(share * top for share in SPEEDS))
    mechanism = Mechanism('viscous_friction', 'friction', site, ('speed',), 'odd')
    form = over_speed(site, lambda x: np.column_stack(
        [np.minimum(x, k) if k < top else x for k in knots]))
    return builder.resistance(mechanism, form, [1] * len(knots), knots)


def _stribeck(builder: Builder, site: str) -> Hypothesis | None:
    """
    Friction that falls with speed, from rest or after a rise: a film needs some speed to build.

    In bells, and in what is between two of them. A servo file that has some may have too much.
    Source: Makkar, Dixon, Sawyer, Hu: AIM 2005, friction that is smooth through rest.
    """
    name = f'{site}_speed'
    top, low = builder.scales.top(name), builder.scales.slowest(name)
    if not 0.0 < low < 0.4 * top:
        return None
    knots = np.geomspace(max(low, 1e-3 * top), 0.4 * top, FADES)
    mechanism = Mechanism('stribeck_friction', 'friction', site, ('speed',), 'odd')

    def budget(speed: np.ndarray) -> np.ndarray:
        bells = np.exp(-(speed[:, None] / knots) ** 2)
        return np.hstack((bells, np.diff(bells)))

    falling = any(placed.effect.name in ('stribeck_friction', 'friction_over_speed')
                  for placed in builder.samples.servo.effects)
    return builder.resistance(mechanism, over_speed(site, budget), [1] * (2 * FADES - 1),
                              (*knots, *knots[1:]), either=falling)


def _drag(builder: Builder, site: str) -> Hypothesis | None:
    """Friction that grows ever faster with speed."""
    top = builder.scales.top(f'{site}_speed')
    mechanism = Mechanism('quadratic_drag', 'friction', site, ('speed',), 'odd')

    def budget(speed: np.ndarray) -> np.ndarray:
        share = speed / top
        return top * np.column_stack((*(share**power for power in POWERS),
                                      np.maximum(share - 0.5, 0.0)))

    return builder.resistance(mechanism, over_speed(site, budget), [1] * 4, (*POWERS, 0.5))


def _by_load(builder: Builder, site: str, carried: bool) -> Hypothesis | None:
    """
    Friction that grows with the transmitted torque.

    Or with that less the friction of the load (``carried``): where all friction is written at one
    shaft, the gears carry that without it.
    """
    top = builder.scales.load
    if not top > 0.0 or carried and not any(
            placed.effect.port == 'friction' and placed.site == 'load'
            for placed in builder.samples.servo.effects):
        return None
    lever = builder.samples.servo.numbers['mechanism.ratio'] if site == 'motor' else 1.0

    def budget(load: np.ndarray) -> np.ndarray:
        bends = [np.minimum(load, share * top) for share in LOADS]
        grows = [np.maximum(load - share * top, 0.0) for share in LOADS]
        return np.column_stack((load, *bends, *grows)) / lever

    knots = (top, *(share * top for share in LOADS), *(share * top for share in LOADS))
    form = Form('load', 'N m', 'N m', lambda one: np.abs(
        one.carried_load if carried else one.predicted_load), budget)
    return builder.resistance(_loaded(site), form, [1] * len(knots), knots)


def _driven_back(builder: Builder, site: str) -> Hypothesis | None:
    """Friction of one share of the torque where the motor drives, another where the load does."""
    if not builder.scales.load > 0.0:
        return None
    lever = builder.samples.servo.numbers['mechanism.ratio'] if site == 'motor' else 1.0
    form = Form('load', 'N m', 'N m', lambda one: one.predicted_load * one.motion.direction,
                lambda x: np.maximum(np.column_stack((x, -x)), 0.0) / lever)
    one = builder.resistance(_loaded(site), form, [1, 1],
                             detail={'law': 'load_dependent_friction'})
    return one if one and one.columns.size > 1 else None  # where both drive


def _loaded(site: str) -> Mechanism:
    return Mechanism('load_dependent_friction', 'friction', site, ('load', 'direction'), 'odd')


def _drifting(site: str) -> Mechanism:
    return Mechanism('friction_drift', 'friction', site, ('time', 'temperature'), 'odd')


def _temperatures(builder: Builder) -> tuple[float, float]:
    """Return the mean temperature of all recordings and its range, degC."""
    warm = np.concatenate([one.motion['temperature'] for one in builder.samples.errors])
    return float(np.mean(warm)), float(np.ptp(warm))


def _drift(builder: Builder, site: str, viscous: bool) -> Hypothesis | None:
    """Friction that settles with time or follows a temperature: at any speed, or with it."""
    times = [share * builder.scales.duration for share in TIMES]
    mean, span = _temperatures(builder)

    def budget(one: EquationErrors) -> np.ndarray:
        fading = [np.exp(-one.motion.time / settling) for settling in times]
        if span > 0.0:
            fading.append((mean - one.motion['temperature']) / span)
        return np.column_stack(fading) * (speed_of(one, site)[:, None] if viscous else 1.0)

    top = builder.scales.top(f'{site}_speed')
    known = builder.rubbing(site, lambda one: speed_of(one, site), np.array([0.0, top]))
    most = known[1] / top if viscous and top > 0.0 else known.max()  # what can fade
    unit = 'N m s/rad' if viscous else 'N m'
    form = Form('time', 's', unit, lambda one: one.motion.time, lambda x: np.column_stack(
        [*(np.exp(-x / settling) for settling in times), *[np.zeros(len(x))] * (span > 0.0)]))
    return builder.hypothesis(
        _drifting(site), builder.resisting(site, budget), [1] * (len(times) + (span > 0.0)), times,
        either=True, form=form, room=(-most, np.inf), detail={'mean': mean, 'span': span} | (
            {'law': 'viscous_drift'} if viscous else {}))


def _thinning(builder: Builder, site: str, viscous: bool, residual: np.ndarray
              ) -> Hypothesis | None:
    """Friction of grease that thins with the temperature; ``residual`` (samples,) tells how."""
    mean, span = _temperatures(builder)
    if not span > 0.0:
        return None

    def budget(one: EquationErrors, thinning: float) -> np.ndarray:
        warmer = one.motion['temperature'] - mean
        return np.expm1(-thinning * warmer)[:, None] / thinning * (
            speed_of(one, site)[:, None] if viscous else 1.0)

    thinning, columns = builder.best_columns(
        THINS[0] / span, THINS[1] / span, f'{site}_torque',
        lambda one, thinning: -one.motion.direction[:, None] * budget(one, thinning), residual)
    return builder.hypothesis(
        _drifting(site), columns, [0], (thinning, mean), tried=SHAPES,
        detail={'law': 'viscous_drift'} if viscous else {})


def _presliding(builder: Builder, site: str) -> Hypothesis | None:
    """
    Friction that builds up over the travel after a reversal.

    What lacks of the full level: by Maxwell-slip elements, which remember inner loops, and by a
    decay over the travel, which builds up as slowly as any element does.
    """
    name = f'{site}_angle'
    low = builder.scales.finest(site)
    high = 0.05 * builder.scales.stroke(name)
    if not 0.0 < low < high:
        return None
    stops = np.geomspace(low, high, STOPS)
    mechanism = Mechanism('presliding_friction', 'friction', site, ('travel since reversal',),
                          'odd', memory=True)
    ratio = builder.samples.servo.numbers['mechanism.ratio'] if site == 'motor' else 1.0

    def torque(one: EquationErrors) -> np.ndarray:
        way = one.motion.direction[:, None]
        elements = np.column_stack([stop_operator(one.motion[name], stop) for stop in stops])
        decays = way * np.exp(-ratio * one.motion.travel[:, None] / stops)
        return np.hstack((way - elements, decays))

    form = Form('travel since reversal', 'rad', 'N m', lambda one: one.motion.travel,
                lambda x: np.hstack((np.maximum(2.0 - ratio * x[:, None] / stops, 0.0),
                                     np.exp(-ratio * x[:, None] / stops))))
    return builder.hypothesis(mechanism, builder.place(f'{site}_torque', torque),
                              [1] * 2 * STOPS, (*stops, *stops), form=form)


def _by_angle(builder: Builder, site: str, residual: np.ndarray) -> Iterator[Hypothesis]:
    """Friction that varies over the turn of a shaft: in waves, or in any way."""
    mechanism = Mechanism('position_dependent_friction', 'friction', site,
                          ('angle', 'direction'), 'odd')
    angle = f'{site}_angle'
    yield from periodic(builder, mechanism, residual, shaft_equation(builder, site), angle,
                        f'{site}_torque', 'direction', lambda one: -one.motion.direction, 'N m',
                        mean=True)
    low, high = builder.scales.travel(angle)
    if 0.0 < high - low <= 2.0 * np.pi:
        edges = np.linspace(low, high, PLACES)
        form = Form('angle', 'rad', 'N m', lambda one: one.motion[angle],
                    lambda x: hats(x, edges))
        one = builder.resistance(mechanism, form, [0] * PLACES, edges)
        if one:
            yield one
