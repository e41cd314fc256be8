"""Readings of torque and current that are off: by a gain, an offset, a delay, or over a turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import shifted
from .builder import Builder
from .clocks import calm_torque, clocks_of, delay_by, late_reading
from .encoders import encoders_of
from .hypothesis import Form, Hypothesis, Mechanism, Series
from .memory import hurried, lagged, LOOPS, stop_operator
from .orders import hats, periodic
from .shape_search import best_shape, LATE, SHAPES
from .torque import shaken

MOMENTS = 6
"""Of a recording, between which an offset changes evenly."""

RANGES = (0.1, 0.3, 0.6)
"""Shares of the largest reading from which another gain may hold."""


Behind = Callable[[np.ndarray, float, float], np.ndarray]
"""What comes behind a series (samples,) by a time, s, at a period, s."""


def readings_of(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """
    Yield the hypotheses of the sensors that every recording has.

    ``residual`` (samples,) tells orders.
    """
    has = frozenset.intersection(*(one.measured.channels for one in builder.samples.errors))

    def off(name: str, channel: str, variables: tuple[str, ...], symmetry: str, of: Series,
            signs: tuple[int, ...] = (0,), knots: tuple[float, ...] = (),
            tried: int = 1, **more: bool) -> Hypothesis | None:
        mechanism = Mechanism(name, 'sensor', channel, variables, symmetry, **more)
        columns = builder.place(channel, of, -1.0)  # what a reading has too much is not true
        return builder.hypothesis(mechanism, columns, signs, knots, tried=tried)

    def late(name: str, channel: str, excess: Series) -> Hypothesis | None:
        low, high = (share * builder.scales.period for share in LATE)
        time = best_shape(low, high, lambda time: builder.apart(builder.place(
            channel, partial(excess, time), -1.0).table[:, 0]), builder.apart(residual),
            whole=True)
        return by_time(name, channel, partial(excess, time), time)

    def by_time(name: str, channel: str, excess: Series, time: float) -> Hypothesis | None:
        return off(name, channel, ('time',), 'none', excess, (1,), (time,), SHAPES,
                   memory=True, driving=channel == 'current' and not driven)

    def delayed() -> Hypothesis | None:
        time = delay_by(builder, 'torque', calm_torque, residual)
        return by_time('sensor_delay', 'torque', partial(
            late_reading, calm_torque, np.array([time])), time)

    def full(one: EquationErrors) -> int:
        return len(one.measured.recording)

    driven = 'drive' in builder.samples.present
    for channel, sensor in (('current', 'current_sensor'), ('torque', 'torque_sensor')):
        if channel not in has:
            continue
        yield from filter(None, (
            off(f'{sensor}_offset', channel, ('constant',), 'even',
                lambda one: np.ones((full(one), 1))),
            _drifting(builder, f'{sensor}_offset', channel),
            late('sensor_lag', channel, partial(_behind, lagged) if channel == 'current'
                 else _after_lag)))
        if channel == 'torque' or driven:
            yield from filter(None, (
                delayed() if channel == 'torque' else late(
                    'sensor_delay', channel, partial(_behind, shifted)),
                *(_gain(builder, f'{sensor}_gain', channel, by)
                  for by in ('constant', channel, 'time'))))
    if 'torque' in has:
        yield from _torque_over_angle(builder, residual)
        yield from filter(None, (_torque_loops(builder), _inertia_before(builder)))
    yield from encoders_of(builder, has, residual)
    yield from clocks_of(builder, has)


def _behind(behind: Behind, time: float, one: EquationErrors) -> np.ndarray:
    """
    Return how much too much a current reads that comes behind its truth.

    That is what the drive makes of its command, or else what the motion asks for, which is smooth.
    """
    asked = one.known_current
    if 'drive' in one.equations:
        asked = np.nan_to_num(one.drive_current(one.servo.theta))
    return (behind(asked, time, one.measured.period) - asked)[:, None]


def _after_lag(time: float, one: EquationErrors) -> np.ndarray:
    """Return how much too much a torque reads that comes behind a lag of a time, s."""
    read = one.motion.calm_torque
    return (read - hurried(read, time, one.measured.period))[:, None]


def _torque_over_angle(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """A torque that a sensor reads by the place of its shaft; no torque says so at the motor."""
    mechanism = Mechanism('torque_sensor_offset', 'sensor', 'torque', ('angle',), 'even')
    equation = next(name for name in ('motor', 'load', *EQUATIONS)
                    if name in builder.samples.present)
    for one in periodic(builder, mechanism, residual, equation, 'load_angle', 'torque', '',
                        lambda one: -np.ones(len(one.motion.rows)), 'N m'):
        yield replace(one, detail={'law': 'torque_sensor_ripple'})


def _torque_loops(builder: Builder) -> Hypothesis | None:
    """A torque that reads otherwise while it rises than while it falls."""
    knots = tuple(share * builder.scales.torque for share in LOOPS)
    if not builder.scales.torque > 0.0:
        return None
    mechanism = Mechanism('torque_sensor_hysteresis', 'sensor', 'torque', ('torque',), 'odd',
                          memory=True)
    columns = builder.place('torque', lambda one: np.column_stack(
        [stop_operator(one.motion.calm_torque, width) for width in knots]), -1.0)
    return builder.hypothesis(mechanism, columns, [1] * len(knots), knots, either=True)


def _inertia_before(builder: Builder) -> Hypothesis | None:
    """A part of the load's inertia between the transmission and the sensor of its torque."""
    mechanism = Mechanism('torque_sensor_inertia', 'sensor', 'torque', ('acceleration',), 'odd')
    columns = builder.place('torque', lambda one: -shaken(one)[:, None], -1.0)
    return builder.hypothesis(mechanism, columns, [1])


def _drifting(builder: Builder, name: str, channel: str) -> Hypothesis | None:
    """An offset that changes over the time of a recording."""
    edges = np.linspace(0.0, builder.scales.duration, MOMENTS)
    mechanism = Mechanism(name, 'sensor', channel, ('time',), 'even')

    def over(one: EquationErrors) -> np.ndarray:
        return hats(one.measured.period * np.arange(len(one.measured.recording)), edges)

    form = Form('time', 's', 'A' if channel == 'current' else 'N m',
                lambda one: one.motion.time, lambda x: hats(x, edges))
    return builder.hypothesis(mechanism, builder.place(channel, over, -1.0), [0] * MOMENTS,
                              tuple(edges), form=form)


def _gain(builder: Builder, name: str, channel: str, by: str) -> Hypothesis | None:
    """
    A reading in proportion to its truth, or whose gain changes ``by`` sign and size, or by time.

    A current is what the motion asks for, or what the drive makes: its reading would explain its
    own noise. The reading of the torque is smoothed over the test function, and what the motion
    asks for hangs on the friction of the load. Without the drive's command the gain of a current
    sensor cannot be told from the torque constant.
    """
    current = channel == 'current'
    unit, top = ('A', builder.scales.current) if current else ('N m', builder.scales.torque)
    moments = np.linspace(0.0, builder.scales.duration, MOMENTS)

    def truth(one: EquationErrors) -> np.ndarray:
        return one.known_current if current else one.motion.calm_torque

    def bent(x: np.ndarray) -> np.ndarray:
        beyond = [np.sign(x) * np.maximum(np.abs(x) - share * top, 0.0) for share in RANGES]
        return np.column_stack((x, np.abs(x), *beyond))

    def excess(x: np.ndarray, time: np.ndarray) -> np.ndarray:
        if by == channel:
            return bent(x)
        return x[:, None] * hats(time, moments) if by == 'time' else x[:, None]

    columns = builder.place(channel, lambda one: excess(truth(one), one.motion.time), -1.0)
    if current:
        made = builder.place('current', lambda one: excess(
            one.drive_current(one.servo.theta),
            one.measured.period * np.arange(len(one.measured.recording))), -1.0)
        drive = builder.samples.rows('drive')[:, None]
        columns = replace(columns, table=np.where(drive, made.table, columns.table))
    mechanism = Mechanism(name, 'sensor', channel, (channel,) if by != 'time' else (
        channel, 'time'), 'odd')
    if by == 'constant':
        return builder.hypothesis(mechanism, columns, [0])
    if by == 'time':
        return builder.hypothesis(mechanism, columns, [1] * MOMENTS, tuple(moments), either=True,
                                  form=Form('time', 's', '', lambda one: one.motion.time,
                                            lambda x: hats(x, moments)))
    return builder.hypothesis(mechanism, columns, [1, 0, *[1] * len(RANGES)], either=True,
                              form=Form(channel, unit, unit, truth, bent))
