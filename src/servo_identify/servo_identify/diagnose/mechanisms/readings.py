"""Readings that are off: by a gain, an offset, a delay, or once a turn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import Hypothesis, Mechanism, Series
from .orders import waves


def readings_of(builder: Builder) -> Iterator[Hypothesis]:
    """Yield the hypotheses of the sensors that every recording has."""
    has = frozenset.intersection(*(one.measured.channels for one in builder.samples.errors))

    def off(name: str, channel: str, variables: tuple[str, ...], symmetry: str, of: Series,
            size: int = 1) -> Hypothesis | None:
        mechanism = Mechanism(name, 'sensor', channel, variables, symmetry)
        columns = builder.place(channel, of, -1.0)  # what a reading has too much is not true
        return builder.hypothesis(mechanism, columns, [0] * size)

    def full(one: EquationErrors) -> int:
        return len(one.measured.recording)

    for channel, sensor in (('current', 'current_sensor'), ('torque', 'torque_sensor')):
        if channel not in has:
            continue
        yield from filter(None, (
            off(f'{sensor}_offset', channel, ('constant',), 'even',
                lambda one: np.ones((full(one), 1))),))
        if channel == 'torque' or 'drive' in builder.samples.present:
            yield from filter(None, (_gain(builder, f'{sensor}_gain', channel),))
    if {'motor_position', 'load_position'} <= has:
        yield from filter(None, (
            off('load_encoder_eccentricity', 'load_position', ('angle',), 'even',
                lambda one: waves(one.angles()[1], (1.0,)), 2),
            off('sensor_delay', 'load_position', ('speed',), 'odd',
                lambda one: -_speed(one)[:, None])))


def _gain(builder: Builder, name: str, channel: str) -> Hypothesis | None:
    """
    A reading in proportion to its truth.

    A current is what the motion asks for, or what the drive makes: its reading would explain its
    own noise. The reading of the torque is smoothed over the test function, and what the motion
    asks for hangs on the friction of the load. Without the drive's command the gain of a current
    sensor cannot be told from the torque constant.
    """
    mechanism = Mechanism(name, 'sensor', channel, (channel,), 'odd')
    if channel == 'torque':
        columns = builder.place('torque', lambda one: one.motion.calm_torque[:, None], -1.0)
        return builder.hypothesis(mechanism, columns, [0])
    columns = builder.place('current', lambda one: one.predicted_current[:, None], -1.0)
    made = builder.place('current', lambda one: one.drive_current(one.servo.theta)[:, None],
                         -1.0)
    drive = builder.samples.rows('drive')[:, None]
    return builder.hypothesis(
        mechanism, replace(columns, table=np.where(drive, made.table, columns.table)), [0])


def _speed(one: EquationErrors) -> np.ndarray:
    test, angle = one.measured.fast, np.nan_to_num(one.angles()[1])
    return np.pad(test.smooth(angle, 1), test.reach, mode='edge')
