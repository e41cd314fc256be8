"""How well the twin answers a recording, as numbers: by channel and by balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..physics.drives import VoltageDrive
from ..physics.servo import Servo
from ..recording.recording import BALANCES, COLUMNS, COMPARED, Predictions, Recording

SPEED_WINDOW = 0.02  # s, over which a speed is the difference of an angle

_BALANCE_UNITS = dict(zip(BALANCES, ('A', 'N m', 'rad', 'N m', 'V', 'rad/s', 'N m'), strict=True))


@dataclass(frozen=True)
class ChannelFit:
    """
    One channel: rig against twin.

    ``goodness`` is R of paper 000 eq. 13 (1: the twin is the rig; it may be negative), ``rms`` and
    ``largest`` are of rig less twin in ``unit``, ``noise`` is the sensor's standard deviation.
    """

    channel: str
    unit: str
    goodness: float
    rms: float
    largest: float
    noise: float


@dataclass(frozen=True)
class BalanceFit:
    """One balance: root mean square of the residual over its noise floor, which has ``unit``."""

    balance: str
    unit: str
    floor: float
    over_noise: float


@dataclass(frozen=True)
class Fit:
    """All channels and balances of one recording that could be compared."""

    channels: tuple[ChannelFit, ...]
    balances: tuple[BalanceFit, ...]


def goodness(rig: np.ndarray, twin: np.ndarray) -> float:
    """
    Return R of paper 000 eq. 13, of samples that are known on both sides.

    .. math:: R = 1 - \\sqrt{\\sum (y - \\hat y)^2 / \\sum y^2}

    NaN when nothing can be compared or the rig reads zero throughout.
    """
    known = np.isfinite(rig) & np.isfinite(twin)
    energy = float(np.sum(rig[known] ** 2))
    if energy == 0.0:
        return float('nan')
    return float(1.0 - np.sqrt(np.sum((rig[known] - twin[known]) ** 2) / energy))


def speed_of(angle: np.ndarray, period: float) -> np.ndarray:
    """Return the speed by differences over :data:`SPEED_WINDOW`, as long as the angle, 1/s."""
    half = max(1, round(SPEED_WINDOW / period / 2))
    speed = np.full(len(angle), np.nan)
    if len(angle) > 2 * half:
        speed[half:-half] = (angle[2 * half:] - angle[:-2 * half]) / (2 * half * period)
    return speed


def fit_of(recording: Recording, answer: Predictions, servo: Servo) -> Fit:
    """
    Compare a recording with the answer of the servo's twin.

    Channels that the rig does not measure, and balances that need them, are left out. The speeds
    of both shafts, which paper 000 compares, are differences of the angles on both sides alike.
    """
    units = _BALANCE_UNITS | ({'drive': 'V'} if servo.drive is VoltageDrive else {})
    rig = {name: recording[name][:len(answer)] for name in COMPARED}
    twin = {name: answer.prediction[name] for name in COMPARED}
    noise = dict(zip(COMPARED, answer.channel_noise, strict=True))
    channels = [_channel(name, servo.reads(COLUMNS[name], name), rig[name], twin[name],
                         noise[name]) for name in COMPARED]
    for shaft in ('motor', 'load'):
        pair = [speed_of(side[f'{shaft}_position'], recording.period) for side in (rig, twin)]
        name = f'{shaft}_speed'
        channels.append(_channel(name, servo.reads('rad/s', name), *pair, float('nan')))
    balances = []
    for name, floor in zip(BALANCES, answer.balance_noise, strict=True):
        residual = answer.residual[name]
        known = residual[np.isfinite(residual)]
        if len(known):
            balances.append(BalanceFit(name, servo.reads(units[name], name), float(floor),
                                       float(np.sqrt(np.mean(known**2)))))
    return Fit(tuple(c for c in channels if c is not None), tuple(balances))


def _channel(name: str, unit: str, rig: np.ndarray, twin: np.ndarray,
             noise: float) -> ChannelFit | None:
    gap = (rig - twin)[np.isfinite(rig) & np.isfinite(twin)]
    if not len(gap):
        return None
    return ChannelFit(name, unit, goodness(rig, twin),
                      float(np.sqrt(np.mean(gap**2))), float(np.max(np.abs(gap))), float(noise))
