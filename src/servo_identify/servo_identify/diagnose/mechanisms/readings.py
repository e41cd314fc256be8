"""Readings that are off: by a gain, an offset, a delay, or once a turn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import shifted
from .builder import Builder
from .drive import delay_of_command, DELAYS
from .hypothesis import Columns, Form, Hypothesis, Mechanism, Series
from .orders import hats, waves

ENCODERS = ('motor_position', 'load_position')
ORDERS = (1.0, 2.0)
"""Of a disc that is not centred, and of one that is not round."""

MOMENTS = 6
"""Of a recording, between which an offset changes evenly."""

RANGES = (0.1, 0.3, 0.6)
"""Shares of the largest reading from which another gain may hold."""


def readings_of(builder: Builder) -> Iterator[Hypothesis]:
    """Yield the hypotheses of the sensors that every recording has."""
    has = frozenset.intersection(*(one.measured.channels for one in builder.samples.errors))

    def off(name: str, channel: str, variables: tuple[str, ...], symmetry: str, of: Series,
            signs: tuple[int, ...] = (0,), knots: tuple[float, ...] = (),
            tried: int = 1) -> Hypothesis | None:
        mechanism = Mechanism(name, 'sensor', channel, variables, symmetry)
        columns = builder.place(channel, of, -1.0)  # what a reading has too much is not true
        return builder.hypothesis(mechanism, columns, signs, knots, tried=tried)

    def full(one: EquationErrors) -> int:
        return len(one.measured.recording)

    for channel, sensor in (('current', 'current_sensor'), ('torque', 'torque_sensor')):
        if channel not in has:
            continue
        yield from filter(None, (
            off(f'{sensor}_offset', channel, ('constant',), 'even',
                lambda one: np.ones((full(one), 1))),
            _drifting(builder, f'{sensor}_offset', channel)))
        if channel == 'torque' or 'drive' in builder.samples.present:
            yield from filter(None, (_gain(builder, f'{sensor}_gain', channel, by)
                                     for by in ('constant', channel, 'time')))
    round_ = ORDERS if builder.turns('load_angle') else ()
    if {'motor_position', 'load_position'} <= has:
        yield from filter(None, (
            *(off('load_encoder_eccentricity', 'load_position', ('angle',), 'even',
                  partial(_once_a_turn, order), (0, 0), (order, order), len(ORDERS))
              for order in round_),
            *(off('sensor_delay', channel, ('speed',), 'odd', partial(_late, channel), (1,))
              for channel in ENCODERS)))
    elif has.intersection(ENCODERS):
        yield from _only_encoder_late(builder, next(iter(has.intersection(ENCODERS))))
        if 'load_position' in has:
            yield from filter(None, (_only_encoder_eccentric(builder, order)
                                     for order in round_))


def _once_a_turn(order: float, one: EquationErrors) -> np.ndarray:
    return waves(one.angles()[1], (order,))


def _late(channel: str, one: EquationErrors) -> np.ndarray:
    return -_speed(one, ENCODERS.index(channel))[:, None]


def _only_encoder_eccentric(builder: Builder, order: float) -> Hypothesis | None:
    """
    Return an eccentricity of the one encoder that there is, at the load.

    Both shafts are where it says, so that they have its error. Torque tells it: what the shaft
    does not do needs none.
    """
    mechanism = Mechanism('load_encoder_eccentricity', 'sensor', 'load_position', ('angle',),
                          'even')
    ratio = builder.samples.servo.numbers['mechanism.ratio']
    wave = partial(_once_a_turn, order)
    columns = builder.place('load_position', wave, -1.0)
    motor = builder.place('motor_position', wave, -ratio)
    return builder.hypothesis(
        mechanism, replace(columns, table=columns.table + motor.table), (0, 0), (order, order),
        tried=len(ORDERS))


def _only_encoder_late(builder: Builder, channel: str) -> Iterator[Hypothesis]:
    """
    Yield a delay of the one encoder that there is.

    Nothing says at which time the shaft truly was but its torque: a late angle and a motor that
    answers late to its current are one. Where no current is measured, neither can be told from a
    late command, so that its columns are the same.
    """
    sensed = all('current' in one.measured.channels for one in builder.samples.errors)
    if not sensed and not all('voltage' in one.measured.channels
                              for one in builder.samples.errors):
        return
    mechanism = Mechanism('sensor_delay', 'sensor', channel, ('time',), 'none', memory=True)
    times = tuple(share * builder.scales.period for share in DELAYS)
    columns = (_through_the_angle if sensed else delay_of_command)(builder, times)
    one = builder.hypothesis(mechanism, columns, [1] * len(times), times)
    if one:
        yield one


def _through_the_angle(builder: Builder, times: tuple[float, ...]) -> Columns:
    """
    Return what an angle that is late by some times (s) does where the current is measured.

    The current that the motion asks for is late with the angle, and so is the speed by which the
    drive is modelled.
    """
    def asked(one: EquationErrors) -> np.ndarray:
        current = one.full(one.predicted_current)
        return np.column_stack([current - shifted(current, -late, one.measured.period)
                                for late in times])

    def made(one: EquationErrors) -> np.ndarray:
        return np.column_stack([one.drive_current_ahead(late) for late in times])

    columns = builder.place('current', asked)
    drive = builder.samples.rows('drive')[:, None]
    return replace(columns, table=np.where(
        drive, builder.place('drive_current', made).table, columns.table))


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


def _speed(one: EquationErrors, shaft: int) -> np.ndarray:
    test, angle = one.measured.fast, np.nan_to_num(one.angles()[shaft])
    return np.pad(test.smooth(angle, 1), test.reach, mode='edge')
