"""How well the twin answers a recording, as numbers: by channel and by balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..physics.drives import VoltageDrive
from ..physics.servo import Servo
from ..recording.recording import BALANCES, COLUMNS, COMPARED, Predictions, Recording

ANGLES = ('motor_position', 'load_position')
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


@dataclass(frozen=True)
class Pair:
    """Rig and twin in one channel, shape (n,), from sample number ``first`` of the replay on."""

    first: int
    rig: np.ndarray
    twin: np.ndarray


@dataclass
class _Sums:
    """Of rig and twin where both are known: count, energy of the rig, squares of the gap."""

    count: int = 0
    energy: float = 0.0
    squares: float = 0.0
    largest: float = 0.0

    def add(self, rig: np.ndarray, twin: np.ndarray) -> None:
        known = np.isfinite(rig) & np.isfinite(twin)
        gap = (rig - twin)[known]
        self.count += len(gap)
        self.energy += float(np.sum(rig[known] ** 2))
        self.squares += float(np.sum(gap ** 2))
        self.largest = max(self.largest, float(np.max(np.abs(gap), initial=0.0)))

    @property
    def goodness(self) -> float:
        if self.energy == 0.0:
            return float('nan')
        return float(1.0 - np.sqrt(self.squares / self.energy))


def goodness(rig: np.ndarray, twin: np.ndarray) -> float:
    """
    Return R of paper 000 eq. 13, of samples that are known on both sides.

    .. math:: R = 1 - \\sqrt{\\sum (y - \\hat y)^2 / \\sum y^2}

    NaN when nothing can be compared or the rig reads zero throughout.
    """
    sums = _Sums()
    sums.add(rig, twin)
    return sums.goodness


def _half(period: float) -> int:
    return max(1, round(SPEED_WINDOW / period / 2))


def speed_of(angle: np.ndarray, period: float) -> np.ndarray:
    """Return the speed by differences over :data:`SPEED_WINDOW`, as long as the angle, 1/s."""
    half = _half(period)
    speed = np.full(len(angle), np.nan)
    if len(angle) > 2 * half:
        speed[half:-half] = (angle[2 * half:] - angle[:-2 * half]) / (2 * half * period)
    return speed


class Fitting:
    """
    Compares a recording with the answer of the servo's twin, part by part.

    Channels that the rig does not measure, and balances that need them, are left out. The speeds
    of both shafts, which paper 000 compares, are differences of the angles on both sides alike.
    """

    def __init__(self, servo: Servo, period: float) -> None:
        self._servo, self._period, self._half = servo, period, _half(period)
        self._sums = {name: _Sums() for name in (*COMPARED, 'motor_speed', 'load_speed')}
        self._balances = dict.fromkeys(BALANCES, (0, 0.0))
        self.seen = 0
        self._tails = {name: (np.empty(0), np.empty(0)) for name in ANGLES}
        self._channel_noise: dict[str, float] = {}
        self._floors: dict[str, float] = {}

    def add(self, recording: Recording, answer: Predictions) -> dict[str, Pair]:
        """Take in the next part and its answer; return by channel what was compared."""
        pairs = {name: Pair(self.seen, recording[name], answer.prediction[name])
                 for name in COMPARED}
        for name in ANGLES:
            pairs[name.replace('position', 'speed')] = self._speeds(name, pairs[name])
        for name, pair in pairs.items():
            self._sums[name].add(pair.rig, pair.twin)
        for name, (count, squares) in self._balances.items():
            residual = answer.residual[name]
            known = residual[np.isfinite(residual)]
            self._balances[name] = count + len(known), squares + float(np.sum(known ** 2))
        self.seen += len(recording)
        self._channel_noise = dict(zip(COMPARED, answer.channel_noise, strict=True))
        self._floors = dict(zip(BALANCES, answer.balance_noise, strict=True))
        return pairs

    @property
    def fit(self) -> Fit:
        """What was found so far."""
        servo = self._servo
        units = _BALANCE_UNITS | ({'drive': 'V'} if servo.drive is VoltageDrive else {})
        return Fit(
            tuple(ChannelFit(name, servo.reads(COLUMNS.get(name, 'rad/s'), name), one.goodness,
                             float(np.sqrt(one.squares / one.count)), one.largest,
                             float(self._channel_noise.get(name, np.nan)))
                  for name, one in self._sums.items() if one.count),
            tuple(BalanceFit(name, servo.reads(units[name], name), float(self._floors[name]),
                             float(np.sqrt(squares / count)))
                  for name, (count, squares) in self._balances.items() if count))

    def _speeds(self, name: str, pair: Pair) -> Pair:
        """Return the speeds that an angle of this part completes."""
        tails = self._tails[name]
        sides = [np.concatenate(both) for both in zip(tails, (pair.rig, pair.twin), strict=True)]
        self._tails[name] = (sides[0][-2 * self._half:], sides[1][-2 * self._half:])
        whole = slice(self._half, -self._half)
        return Pair(self.seen - len(tails[0]) + self._half, *(
            speed_of(side, self._period)[whole] for side in sides))


def fit_of(recording: Recording, answer: Predictions, servo: Servo) -> Fit:
    """Compare a whole recording with the answer of the servo's twin; see :class:`Fitting`."""
    fitting = Fitting(servo, recording.period)
    fitting.add(recording, answer)
    return fitting.fit
