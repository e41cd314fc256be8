"""
Friction: what resists the motion of a shaft, by speed, load, angle, direction, time and travel.

Each mechanism is a family of curves, not a formula: friction that falls with speed, that grows
with it ever faster, that grows with the load.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .builder import Builder
from .hypothesis import Hypothesis, Mechanism
from .memory import stop_operator
from .orders import hats, periodic

LOADS = (0.1, 0.3, 0.6)  # shares of the largest load at which the growth may bend
SPEEDS = (0.1, 0.3, 0.6)  # shares of the highest speed at which it may bend
POWERS = (1.5, 2.0, 3.0)  # of the speed, with which drag may grow
FADES = 6  # speeds within which friction may fall
TIMES = (0.05, 0.15, 0.5, 1.5)  # shares of the longest recording in which friction may settle
STOPS = 6  # travels over which friction may build up
PLACES = 12  # of a part of a turn at which friction has a value of its own


def friction_of(builder: Builder, site: str, residual: np.ndarray) -> Iterator[Hypothesis]:
    """Yield the hypotheses of friction at a shaft; ``residual`` (samples,) tells orders."""
    several = (_coulomb, _viscous, _stribeck, _drag, _asymmetric, _by_load, _drift, _presliding)
    yield from filter(None, (one(builder, site) for one in several))
    yield from _by_angle(builder, site, residual)


def shaft_equation(builder: Builder, site: str) -> str:
    """Equation in which a torque at a shaft shows."""
    return site if site in builder.samples.present else 'torque'


def _speed(one, site: str) -> np.ndarray:
    return np.abs(one.motion[f'{site}_speed'])


def _coulomb(builder, site):
    mechanism = Mechanism('coulomb_friction', 'friction', site, ('direction',), 'odd')
    columns = builder.resisting(site, lambda one: np.ones((len(one.motion.rows), 1)))
    return builder.hypothesis(mechanism, columns, [0])


def _viscous(builder, site):
    """Friction that grows with speed, in proportion or ever less."""
    top = builder.scales.top(f'{site}_speed')
    knots = (top, *(share * top for share in SPEEDS))
    mechanism = Mechanism('viscous_friction', 'friction', site, ('speed',), 'odd')
    columns = builder.resisting(site, lambda one: np.column_stack(
        [np.minimum(_speed(one, site), k) if k < top else _speed(one, site) for k in knots]))
    return builder.hypothesis(mechanism, columns, [1] * len(knots), knots, either=True)


def _stribeck(builder, site):
    """Friction that falls with speed: a mixture of bells, which holds exponentials too."""
    name = f'{site}_speed'
    top, low = builder.scales.top(name), builder.scales.slowest(name)
    if not 0.0 < low < 0.4 * top:
        return None
    knots = np.geomspace(max(low, 1e-3 * top), 0.4 * top, FADES)
    mechanism = Mechanism('stribeck_friction', 'friction', site, ('speed',), 'odd')
    columns = builder.resisting(site, lambda one: np.exp(
        -(_speed(one, site)[:, None] / knots) ** 2))
    return builder.hypothesis(mechanism, columns, [1] * FADES, knots, either=True)


def _drag(builder, site):
    """Friction that grows ever faster with speed."""
    top = builder.scales.top(f'{site}_speed')
    mechanism = Mechanism('quadratic_drag', 'friction', site, ('speed',), 'odd')

    def budget(one):
        share = _speed(one, site) / top
        return top * np.column_stack((*(share**power for power in POWERS),
                                      np.maximum(share - 0.5, 0.0)))

    return builder.hypothesis(mechanism, builder.resisting(site, budget), [1] * 4,
                              (*POWERS, 0.5), either=True)


def _asymmetric(builder, site):
    """Friction with another level, and growth, in one direction."""
    mechanism = Mechanism('asymmetric_friction', 'friction', site, ('direction',), 'none')

    def torque(one):
        return -np.column_stack((np.ones(len(one.motion.rows)), _speed(one, site),
                                 one.motion.direction))

    return builder.hypothesis(mechanism, builder.place(f'{site}_torque', torque), [0] * 3)


def _by_load(builder, site):
    """Friction that grows with the transmitted torque."""
    top = builder.scales.load
    if not top > 0.0:
        return None
    mechanism = Mechanism('load_dependent_friction', 'friction', site, ('load', 'direction'),
                          'odd')
    lever = builder.samples.servo.values['mechanism.ratio'] if site == 'motor' else 1.0

    def budget(one):
        load = np.abs(one.predicted_load)
        bends = [np.minimum(load, share * top) for share in LOADS]
        grows = [np.maximum(load - share * top, 0.0) for share in LOADS]
        return np.column_stack((load, *bends, *grows)) / lever

    knots = (top, *(share * top for share in LOADS), *(share * top for share in LOADS))
    return builder.hypothesis(mechanism, builder.resisting(site, budget), [1] * len(knots),
                              knots, either=True)


def _drift(builder, site):
    """Friction that settles with time, or follows a temperature."""
    times = [share * builder.scales.duration for share in TIMES]
    mechanism = Mechanism('friction_drift', 'friction', site, ('time', 'temperature'), 'odd')
    warm = np.concatenate([one.motion['temperature'] for one in builder.samples.errors])
    mean, span = float(np.mean(warm)), float(np.ptp(warm))

    def budget(one):
        fading = [np.exp(-one.motion.time / settling) for settling in times]
        if span > 0.0:
            fading.append((mean - one.motion['temperature']) / span)
        return np.column_stack(fading)

    return builder.hypothesis(mechanism, builder.resisting(site, budget),
                              [1] * (len(times) + (span > 0.0)), times, either=True)


def _presliding(builder, site):
    """
    Friction that builds up over the travel after a reversal.

    What lacks of the full level: by Maxwell-slip elements, which remember inner loops, and by a
    decay over the travel, which builds up as slowly as any element does.
    """
    name = f'{site}_angle'
    least, most = builder.scales.strokes(name)
    low, high = 0.002 * least, 0.05 * most
    if not 0.0 < low < high:
        return None
    stops = np.geomspace(low, high, STOPS)
    mechanism = Mechanism('presliding_friction', 'friction', site, ('travel since reversal',),
                          'odd', memory=True)
    ratio = builder.samples.servo.values['mechanism.ratio'] if site == 'motor' else 1.0

    def torque(one):
        way = one.motion.direction[:, None]
        elements = np.column_stack([stop_operator(one.motion[name], stop) for stop in stops])
        decays = way * np.exp(-ratio * one.motion.travel[:, None] / stops)
        return np.hstack((way - elements, decays))

    return builder.hypothesis(mechanism, builder.place(f'{site}_torque', torque),
                              [1] * 2 * STOPS, (*stops, *stops))


def _by_angle(builder: Builder, site: str, residual: np.ndarray) -> Iterator[Hypothesis]:
    """Friction that varies over the turn of a shaft: in waves, or in any way."""
    mechanism = Mechanism('position_dependent_friction', 'friction', site,
                          ('angle', 'direction'), 'odd')
    angle = f'{site}_angle'
    yield from periodic(builder, mechanism, residual, shaft_equation(builder, site), angle,
                        f'{site}_torque', 'direction', lambda one: -one.motion.direction,
                        mean=True)
    low, high = builder.scales.travel(angle)
    if 0.0 < high - low <= 2.0 * np.pi:
        edges = np.linspace(low, high, PLACES)
        columns = builder.resisting(site, lambda one: hats(one.motion[angle], edges))
        one = builder.hypothesis(mechanism, columns, [0] * PLACES, edges)
        if one:
            yield one
