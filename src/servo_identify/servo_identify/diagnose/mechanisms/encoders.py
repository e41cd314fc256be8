"""Encoders that are off: not centred, not round, or late."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import shifted
from .builder import Builder
from .clocks import delay_by, late_reading, smooth_angle
from .drive import delay_of_command, DELAYS
from .drive_limits import SHARES
from .hypothesis import Columns, Hypothesis, Mechanism
from .orders import periodic, waves
from .shaft_friction import shaft_equation
from .shape_search import SHAPES

ENCODERS = ('motor_position', 'load_position')
ORDERS = ((1.0,), (2.0,), (1.0, 2.0))
"""Of a disc that is not centred, of one that is not round, and of one that is neither."""


def encoders_of(builder: Builder, has: Collection[str],
                residual: np.ndarray) -> Iterator[Hypothesis]:
    """
    Yield the hypotheses of the encoders; ``has`` are the channels that every recording has.

    ``residual`` (samples,) tells orders.
    """
    seen = [channel for channel in ENCODERS if channel in has]
    if len(seen) == 2:
        yield from filter(None, (*(_eccentric(builder, orders) for orders in _round(builder)),
                                 *(_late(builder, channel, residual)
                                   for channel in ENCODERS)))
    elif seen:
        yield from _only_encoder_late(builder, seen[0])
        if 'load_position' in seen:
            yield from filter(None, (_only_encoder_eccentric(builder, orders)
                                     for orders in _round(builder)))
    if 'motor_position' in seen:
        yield from _motors_eccentric(builder, residual, only=len(seen) == 1)


def _round(builder: Builder) -> tuple[tuple[float, ...], ...]:
    return ORDERS if builder.turns('load_angle') else ()


def _eccentric(builder: Builder, orders: tuple[float, ...]) -> Hypothesis | None:
    mechanism = Mechanism('load_encoder_eccentricity', 'sensor', 'load_position', ('angle',),
                          'even')
    columns = builder.place('load_position', partial(_once_a_turn, orders), -1.0)
    knots = tuple(np.repeat(orders, 2))
    return builder.hypothesis(mechanism, columns, [0] * len(knots), knots, tried=len(ORDERS))


def _once_a_turn(orders: tuple[float, ...], one: EquationErrors) -> np.ndarray:
    return waves(one.motion['driven_angle'], orders)


def _late(builder: Builder, channel: str, residual: np.ndarray) -> Hypothesis | None:
    """One of two encoders that is late: its error grows with the speed."""
    mechanism = Mechanism('sensor_delay', 'sensor', channel, ('speed',), 'odd')
    reading = partial(smooth_angle, ENCODERS.index(channel))
    time = delay_by(builder, channel, reading, residual)
    columns = builder.place(channel, partial(late_reading, reading, np.array([time])), -1.0)
    return builder.hypothesis(mechanism, columns, (1,), (time,), tried=SHAPES)


def _motors_eccentric(builder: Builder, residual: np.ndarray,
                      only: bool) -> Iterator[Hypothesis]:
    """
    Yield an error of the motor's encoder over its turn: of a disc, or the poles of a resolver.

    No shaft moves so. The torque says it, which such motion would need; with two encoders, the
    other one too. Where it is the ``only`` one, both shafts are where it says.
    """
    mechanism = Mechanism('motor_encoder_eccentricity', 'sensor', 'motor_position', ('angle',),
                          'even')
    equation = 'transmission' if 'transmission' in builder.samples.present else (
        shaft_equation(builder, 'motor'))
    ratio = builder.samples.servo.numbers['mechanism.ratio']
    for one in periodic(builder, mechanism, residual, equation, 'motor_angle', 'motor_position',
                        '', lambda one: -np.ones(len(one.motion.rows)), 'rad'):
        of = one.columns.of
        if not only or of is None:
            yield one
            continue
        load = builder.place('load_position', of, 1.0 / ratio)
        yield replace(one, columns=one.columns.plus(load).packed())


def _only_encoder_eccentric(builder: Builder, orders: tuple[float, ...]
                            ) -> Hypothesis | None:
    """
    Return an eccentricity of the one encoder that there is, at the load.

    Both shafts are where it says, so that they have its error. Torque tells it: what the shaft
    does not do needs none.
    """
    mechanism = Mechanism('load_encoder_eccentricity', 'sensor', 'load_position', ('angle',),
                          'even')
    ratio = builder.samples.servo.numbers['mechanism.ratio']
    wave, knots = partial(_once_a_turn, orders), tuple(np.repeat(orders, 2))
    columns = builder.place('load_position', wave, -1.0)
    motor = builder.place('motor_position', wave, -ratio)
    return builder.hypothesis(mechanism, columns.plus(motor), [0] * len(knots), knots,
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
    one = builder.hypothesis(mechanism, columns, [1] * len(times), times, room=SHARES)
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

