"""The smooth motion along which friction laws and other models are evaluated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import correlate1d

from servo_twin.physics.motion_evaluation import MOTION
from servo_twin.physics.servo import Servo

from .breakaway import Breakaway, breakaways, NOISE, WITHIN
from .measured import Measured
from .test_function import taps, TestFunction

BINS, FEWEST = 10, 20  # sizes of torque told apart, and samples of either sign in each
AT_REST = 4.0  # standard deviations of a speed that is noise
CREEP = 0.003  # share of the highest speed below which a shaft counts as at rest
STARTING = 1e-9  # share of the highest speed that a shaft has as it breaks away
RESTING = 0.02  # weight of samples at rest under a test function from which friction says nothing


@dataclass(frozen=True)
class Motion:
    """
    A motion at the samples where a test function has full reach ("inner" samples).

    ``rows`` has shape (inner samples, len(MOTION)); angles in rad on their own shaft, torque on
    the load in N m (NaN where not measured), torsion in rad at the load. ``rest`` (inner samples,)
    tells where it rests and friction may be any, but where it breaks away.
    """

    measured: Measured
    test: TestFunction
    rows: np.ndarray
    rest: np.ndarray
    breakaways: tuple[Breakaway, ...]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.rows[:, MOTION.index(name)] if name in MOTION else getattr(self, name)

    @property
    def driven_angle(self) -> np.ndarray:
        """
        Where the motor would turn the load without any loss, rad, at the inner samples.

        What is lost of the angle is told by it. By the angle of the load, two waves of opposite
        size over either shaft would be that loss itself, and explain any.
        """
        return self['load_angle'] + self['wind_up']

    @cached_property
    def direction(self) -> np.ndarray:
        """Direction of the load shaft at the inner samples, +1 or -1; at rest the last one."""
        return _last_sign(self['load_speed'])

    @cached_property
    def calm_torque(self) -> np.ndarray:
        """Torque under the plain test function, N m: zero only where the torque is."""
        torque = bridged(self.measured.recording['torque'])
        whole = correlate1d(torque, taps(self.test.spacing, 0), mode='nearest')
        return whole[self.test.reach:len(torque) - self.test.reach]

    @cached_property
    def travel(self) -> np.ndarray:
        """Travel of the load shaft since its last reversal, rad, at the inner samples."""
        return since_reversal(self['load_angle'], self.direction)

    @cached_property
    def time(self) -> np.ndarray:
        """Seconds from the start of the recording, at the inner samples."""
        return (self.test.reach + np.arange(len(self.rows))) * self.test.period

    def at_centres(self, series: np.ndarray, test: TestFunction) -> np.ndarray:
        """Return a series of inner samples at the centres of a test function of an equation."""
        at = test.centres(len(self.measured.recording)) - self.test.reach
        return series[np.clip(at, 0, len(series) - 1)]

    def moving(self) -> np.ndarray:
        """Tell at the centres whether both shafts keep moving under the test function."""
        rest = np.ones(len(self.measured.recording))
        rest[self.test.reach:self.test.reach + len(self.rest)] = self.rest
        return self.test.project(rest) < RESTING

    def starting(self) -> np.ndarray:
        """Tell at the centres whether a shaft is about to break away."""
        return np.isin(self.test.centres(len(self.measured.recording)),
                       [one.centre for one in self.breakaways])


def motion_of(measured: Measured, test: TestFunction, servo: Servo,
              angles: tuple[np.ndarray, np.ndarray]) -> Motion:
    """
    Return the motion of a recording under a test function.

    ``angles`` are those of both shafts, rad, readings with the sensor effects taken off.
    """
    ratio = servo.numbers['mechanism.ratio']
    motor, load = (bridged(angle) for angle in angles)
    sensed = 'torque' in measured.channels
    smooth, recording = test.smooth, measured.recording
    inner = slice(test.reach, len(recording) - test.reach)
    torque = smooth(bridged(recording['torque'])) if sensed else np.full(
        inner.stop - inner.start, np.nan)
    torsion = motor / ratio - load
    stiffness = servo.values.get('mechanism.stiffness')
    twisted = torsion[inner] - torque / stiffness if stiffness and sensed else torsion[inner]
    torsion = torsion - middle(twisted, torque)
    current = measured.column('current', 0.0)[inner]
    rows = np.column_stack((
        smooth(motor), smooth(motor, 1), smooth(load), smooth(load, 1), smooth(load, 2), torque,
        smooth(torsion), smooth(torsion, 1), current,
        measured.column('external_torque', 0.0)[inner], measured.temperature[inner],
        np.nan_to_num(bridged(recording['coupled_position']))[inner]))
    rest = _rest(measured, test, rows, ratio)
    speeds = [MOTION.index(f'{shaft}_speed') for shaft in ('motor', 'load')]
    shafts = [(angle, max(WITHIN * measured.counts[name], NOISE * measured.noise[name]))
              for name, angle in (('motor_position', motor), ('load_position', load))
              if name in measured.channels]
    starts = tuple(breakaways(test, rest, shafts))
    for one in starts:
        window = slice(one.centre - 2 * test.reach, one.centre + 1)
        rows[window, speeds] = one.way * STARTING * np.abs(rows[:, speeds]).max(axis=0)
    return Motion(measured, test, rows, rest, starts)


def _rest(measured: Measured, test: TestFunction, rows: np.ndarray, ratio: float) -> np.ndarray:
    """Tell at the inner samples whether a shaft rests or turns back."""
    noise, has = measured.noise, measured.channels
    load, motor = (rows[:, MOTION.index(f'{shaft}_speed')] for shaft in ('load', 'motor'))
    own = noise['load_position'] if 'load_position' in has else noise['motor_position'] / ratio
    slow, speed = AT_REST * test.gain(1) * own, np.abs(load)
    if {'motor_position', 'load_position'} <= has:
        slow = max(slow, AT_REST * test.gain(1) * noise['motor_position'] / ratio)
        speed = np.minimum(speed, np.abs(motor) / ratio)
    slow = max(slow, CREEP * float(np.nanmax(speed, initial=0.0)))
    way = np.sign(load)
    turning = np.zeros(len(speed), dtype=bool)
    turning[1:] = way[1:] != way[:-1]
    turning[:-1] |= turning[1:]
    return (speed <= slow) | turning


def middle(lost: np.ndarray, torque: np.ndarray) -> float:
    """
    Return the middle of the angle that is lost under torques of either sign and one size, rad.

    A transmission that loses as much on one flank as on the other has its zero there, however long
    the recording dwells on either. Where no size of torque occurs with both signs, the median.
    """
    if not np.isfinite(torque).any():
        return float(np.nanmedian(lost))
    size = np.abs(torque)
    edges = np.nanpercentile(size, np.linspace(0.0, 100.0, BINS + 1))
    middles, weights = [], []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        within = (size >= low) & (size <= high) & np.isfinite(lost)
        ahead, behind = lost[within & (torque > 0.0)], lost[within & (torque < 0.0)]
        if min(len(ahead), len(behind)) >= FEWEST:
            middles.append(0.5 * (np.median(ahead) + np.median(behind)))
            weights.append(min(len(ahead), len(behind)))
    return float(np.average(middles, weights=weights) if middles else np.nanmedian(lost))


def shifted(series: np.ndarray, time: float | np.ndarray, period: float) -> np.ndarray:
    """Return a series as it comes ``time`` s later (earlier, if negative), straight between."""
    at = np.arange(len(series))
    return np.interp(at - time / period, at, series)


def bridged(x: np.ndarray) -> np.ndarray:
    """Bridge missing samples, so that a memory survives them; residuals stay NaN there."""
    missing = ~np.isfinite(x)
    if not missing.any() or missing.all():
        return x
    at = np.arange(len(x))
    return np.where(missing, np.interp(at, at[~missing], x[~missing]), x)


def since_reversal(angle: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the travel since the last reversal, rad, shape of ``angle``."""
    samples = np.arange(len(angle))
    turns = np.concatenate(([False], direction[1:] != direction[:-1]))
    anchor = np.maximum.accumulate(np.where(turns, samples, 0))
    return np.abs(angle - angle[anchor])


def _last_sign(speed: np.ndarray) -> np.ndarray:
    samples = np.arange(len(speed))
    moved = np.maximum.accumulate(np.where(speed != 0.0, samples, -1))
    return np.where(moved < 0, 1.0, np.where(speed[np.maximum(moved, 0)] < 0.0, -1.0, 1.0))
