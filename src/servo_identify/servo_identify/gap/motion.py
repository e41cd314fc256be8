"""The smooth motion by which laws are asked: what a bump makes of the readings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from servo_twin.physics.following import MOTION
from servo_twin.physics.servo import Servo

from .observation import Channels, Observation
from .weak_form import Bump

BINS = 10  # sizes of torque that are told apart when the middle of the wind-up is sought
FEWEST = 20  # samples of either sign of a torque that say anything


@dataclass(frozen=True)
class Motion:
    """Smooth motion by which the laws are asked, at full rate over the inner samples."""

    rows: np.ndarray  # (inner samples, len(MOTION))
    weighed: dict[str, np.ndarray]  # derivatives under the bump, at the centres
    moving: np.ndarray  # at the centres: no standstill under the bump
    speed: np.ndarray  # of the motor shaft, rad/s, at every sample, by the fine bump


def motion_of(seen: Observation, channels: Channels, bump: Bump, servo: Servo,
              zero: float | None) -> Motion:
    """
    Return the motion of a recording under a bump.

    ``channels`` are its readings, sensor effects taken off; ``zero`` (rad) is that of the wind-up
    beside its median, where it has been looked for; None: half-way between the flanks.
    """
    ratio = servo.values['mechanism.ratio']
    motor, load = both(channels, ratio)

    def smooth(x, order=0):
        return bump.smooth(bridged(x), order)

    angles = [smooth(motor), smooth(motor, 1), smooth(load), smooth(load, 1),
              bump.weigh(bridged(load), 2, every=True)]
    wind_up = motor / ratio - load
    stiffness = servo.values.get('mechanism.stiffness')
    sensed = np.isfinite(channels.torque).any()
    lost = wind_up - channels.torque / stiffness if stiffness and sensed else wind_up
    if zero is not None:
        wind_up = wind_up - np.nanmedian(lost) - zero
    else:
        wind_up = wind_up - _middle(lost, channels.torque)
    size, reach = len(angles[0]), bump.reach
    inner = slice(reach, reach + size)
    torque = smooth(channels.torque) if sensed else np.full(size, np.nan)
    current = channels.current[inner]
    if not np.isfinite(current).any():
        current = np.zeros(size)
    rows = np.column_stack((*angles, torque, smooth(wind_up), smooth(wind_up, 1),
                            np.nan_to_num(current), seen.external[inner],
                            seen.temperature[inner]))
    weighed = {
        'motor_2': bump.weigh(motor, 2), 'load_2': bump.weigh(load, 2),
        'torque': bump.weigh(channels.torque), 'external': bump.weigh(seen.external),
        'wind_up': bump.weigh(wind_up), 'wind_up_1': bump.weigh(wind_up, 1),
    }
    quick = seen.fine.smooth(bridged(motor), 1)
    speed = np.pad(quick, seen.fine.reach, mode='edge')
    return Motion(rows, weighed, _moving(seen, rows, bump, ratio), speed)


def _middle(lost: np.ndarray, torque: np.ndarray) -> float:
    """
    Return the middle of the angle that is lost under torques of either sign and one size, rad.

    A mesh that loses as much on one flank as on the other has its zero there, however long the
    recording dwells on either. Where no size of torque occurs with both signs, the median.
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


def _moving(seen: Observation, rows: np.ndarray, bump: Bump, ratio: float) -> np.ndarray:
    """Tell at the centres whether both shafts keep moving under the bump."""
    noise = seen.noise
    slow = 4.0 * bump.gain(1) * (noise['load_position'] if seen.has('load')
                                 else noise['motor_position'] / ratio)
    speed = np.abs(rows[:, MOTION.index('load_speed')])
    if seen.has('motor') and seen.has('load'):
        of_motor = np.abs(rows[:, MOTION.index('motor_speed')]) / ratio
        slow = max(slow, 4.0 * bump.gain(1) * noise['motor_position'] / ratio)
        speed = np.minimum(speed, of_motor)
    slow = max(slow, 0.003 * float(np.nanmax(speed, initial=0.0)))
    standing = np.ones(len(seen.recording))
    way = np.sign(rows[:, MOTION.index('load_speed')])
    turning = np.zeros(len(speed), dtype=bool)
    turning[1:] = way[1:] != way[:-1]
    turning[:-1] |= turning[1:]
    standing[bump.reach:bump.reach + len(speed)] = (speed <= slow) | turning
    return bump.weigh(standing) < 0.02


def both(channels: Channels, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """Angles of both shafts; of one encoder the other shaft follows, as the twin's does."""
    motor, load = channels.motor, channels.load
    if not np.isfinite(motor).any():
        motor = (load + channels.wound) * ratio
    elif not np.isfinite(load).any():
        load = motor / ratio - channels.wound
    return motor, load


def bridged(x: np.ndarray) -> np.ndarray:
    """Bridge missing samples, so that a law's memory survives them; residuals stay NaN there."""
    missing = ~np.isfinite(x)
    if not missing.any() or missing.all():
        return x
    at = np.arange(len(x))
    return np.where(missing, np.interp(at, at[~missing], x[~missing]), x)
