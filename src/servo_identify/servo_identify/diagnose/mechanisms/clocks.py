"""Channels that come late, or ever later: those that another clock stamps."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial

import numpy as np

from servo_twin.physics.servo import Servo

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import shifted
from .builder import Builder
from .hypothesis import CLOCK, Hypothesis, Mechanism
from .shape_search import best_shape, LATE, SHAPES

ROUNDS = 4  # of the search for a delay that grows, each from the slope at the one before

Reading = Callable[[EquationErrors], tuple[np.ndarray, np.ndarray]]
"""``of(errors)``: a smoothed channel and the time of each of its samples, s."""


def clocks_of(builder: Builder, has: Collection[str]) -> Iterator[Hypothesis]:
    """
    Yield the hypotheses of a clock that runs apart from that of the other channels.

    ``has`` are the channels that every recording has. Of two encoders either may be meant: that
    of the load is taken, which is more often logged by something else than the drive.
    """
    several: dict[str, Reading] = {}
    if {'motor_position', 'load_position'} <= set(has):
        several['load_position'] = partial(smooth_angle, 1)
    if 'torque' in has:
        several['torque'] = calm_torque
    if 'current' in has:
        several['current'] = lambda one: (one.known_current, one.motion.time)
    for channel, reading in several.items():
        late = late_by(builder, channel, reading, np.zeros(2))
        mechanism = Mechanism(CLOCK, 'sensor', channel, ('time',), 'none', memory=True)
        one = builder.hypothesis(mechanism, builder.place(channel, partial(
            late_reading, reading, late), -1.0), [1], tried=SHAPES**2,
            detail={'told': partial(_told, tuple(late))})
        if one:
            yield one


def delay_by(builder: Builder, channel: str, reading: Reading, residual: np.ndarray) -> float:
    """Return the delay of a channel, s, that takes most of a residual (samples,)."""
    low, high = (share * builder.scales.period for share in LATE)
    near = best_shape(low, high, lambda time: builder.place(channel, partial(
        late_reading, reading, np.array([time])), -1.0).table[:, 0], residual, whole=True)
    return float(np.clip(late_by(builder, channel, reading, np.array([near]))[0], low, high))


def late_by(builder: Builder, channel: str, reading: Reading, start: np.ndarray) -> np.ndarray:
    """
    Return how late a channel comes at the start, s, and by how much more each second, if asked.

    The search begins at ``start``, as many numbers as are asked for.

    Beside all that may move without a fault but the instant of this channel: it is a part of it.
    """
    beside, late = np.zeros((len(builder.samples.base), 0)), start
    if builder.nuisance is not None:
        others = [label != f'late:{channel}' for label in builder.nuisance.labels]
        beside = builder.nuisance.columns[:, others]
    size = np.maximum(np.sqrt((beside**2).sum(axis=0)), 1e-300)
    for _ in range(ROUNDS):
        now, slopes = (builder.place(channel, partial(of, reading, late), -1.0).table
                       for of in (late_reading, _slopes))
        scale = np.maximum(np.sqrt((slopes**2).sum(axis=0)), 1e-300)
        table = np.column_stack((slopes / scale, beside / size))
        change = np.linalg.lstsq(table, builder.samples.base + now[:, 0], rcond=1e-9)[0]
        late = late - change[:len(late)] / scale
    return late


def late_reading(reading: Reading, late: np.ndarray, one: EquationErrors) -> np.ndarray:
    """Return how much too much a channel reads that comes late, (samples, 1)."""
    series, time = reading(one)
    return (series - shifted(series, -np.polyval(late[::-1], time), one.measured.period))[:, None]


def _slopes(reading: Reading, late: np.ndarray, one: EquationErrors) -> np.ndarray:
    series, time = reading(one)
    rate = -shifted(np.gradient(series, one.measured.period), -np.polyval(late[::-1], time),
                    one.measured.period)
    return rate[:, None] * time[:, None] ** np.arange(len(late))


def calm_torque(one: EquationErrors) -> tuple[np.ndarray, np.ndarray]:
    """Return the smoothed torque, N m, and the time of each inner sample, s."""
    return one.motion.calm_torque, one.motion.time


def smooth_angle(shaft: int, one: EquationErrors) -> tuple[np.ndarray, np.ndarray]:
    """Return the smoothed angle of a shaft (0 motor, 1 load), rad, and the time of each sample."""
    test, angle = one.measured.fast, np.nan_to_num(one.angles()[shaft])
    smooth = np.pad(test.smooth(angle, 0), test.reach, mode='edge')
    return smooth, one.measured.period * np.arange(len(smooth))


def _told(found: Sequence[float], knots: Sequence[float], amplitudes: np.ndarray,
          servo: Servo) -> str:
    """Return how far the clock runs apart, in words."""
    late, apart = 1e3 * amplitudes[0] * np.asarray(found)
    words = f'{abs(late):.3g} ms {"late" if late > 0.0 else "early"} at the start, and '
    return words + f'{abs(apart):.3g} ms a second more' + (
        '' if late * apart > 0.0 else ' the other way')
