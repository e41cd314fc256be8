"""Speeds, positions and torques over time, as arrays of set-points from rest to rest."""

from __future__ import annotations

import numpy as np

ACCELERATION = 4.0  # rad/s2 at the load
LEAD = 0.5  # s of rest before and after a motion; the load torque comes and goes in it


def there_and_back(speed: float, angle: float, period: float, acceleration: float = ACCELERATION
                   ) -> np.ndarray:
    """
    Return the speed, rad/s, of a motion forwards, a rest, and the same motion backwards.

    The speed is constant over the whole of ``angle`` (rad); run-up and run-out come on top.
    """
    way = single(speed, angle, period, acceleration)
    still = np.zeros(round(LEAD / period))
    return np.concatenate([still, way, still, -way, still])


def single(speed: float, angle: float, period: float, acceleration: float = ACCELERATION
           ) -> np.ndarray:
    """Return the speed of one motion over ``angle`` at a constant speed, rad/s; no rest."""
    rise = np.arange(0.0, speed, acceleration * period)
    return np.concatenate([rise, np.full(round(angle / speed / period), speed), rise[::-1]])


def eased(speed: np.ndarray, period: float, acceleration: float = ACCELERATION) -> np.ndarray:
    """Return a speed that follows another one from rest with a bounded acceleration."""
    most = acceleration * period
    now, followed = 0.0, []
    for wanted in speed.tolist():
        now += min(max(wanted - now, -most), most)
        followed.append(now)
    return np.array(followed)


def framed(wave: np.ndarray, period: float, lead: float = LEAD) -> np.ndarray:
    """Return a wave between two rests at zero."""
    still = np.zeros(round(lead / period))
    return np.concatenate([still, wave, still])


def loaded(torque: float, size: int, period: float) -> np.ndarray:
    """Return a constant torque that comes in the first rest and goes in the last one, N m."""
    time = np.arange(size) * period
    return torque * np.clip(np.minimum(time, time[-1] - time) / LEAD, 0.0, 1.0)


def triangle(phase: np.ndarray) -> np.ndarray:
    """Return a triangle between -1 and 1 that starts upwards at zero, of phases in turns."""
    return 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * phase))


def chirp(time: np.ndarray, first: float, last: float) -> np.ndarray:
    """Return a sine of size 1 whose frequency, Hz, grows exponentially from first to last."""
    rate = np.log(last / first) / time[-1]
    return np.sin(2.0 * np.pi * first * np.expm1(rate * time) / rate)


def multisine(time: np.ndarray, first: float, last: float, lines: int, seed: int) -> np.ndarray:
    """Return sines on a grid of 0.1 Hz with random phases; the largest value is 1."""
    tones = np.unique(np.round(np.geomspace(first, last, lines), 1))
    turns = np.random.default_rng(seed).random(len(tones))
    wave = np.sin(2.0 * np.pi * (np.outer(time, tones) + turns)).sum(axis=1)
    return wave / np.abs(wave).max()


def staircase(time: np.ndarray, levels: int, dwell: float, seed: int) -> np.ndarray:
    """
    Return steps between -1 and 1, each held for ``dwell`` s.

    The levels are in equal distances, and each comes once before one comes again, in an order
    that is drawn by ``seed``.
    """
    steps, draw = np.linspace(-1.0, 1.0, levels), np.random.default_rng(seed)
    place = (time // dwell).astype(int)
    rounds = int(place[-1]) // levels + 1
    return np.concatenate([draw.permutation(steps) for _ in range(rounds)])[place]


def sinusoids(time: np.ndarray, first: float, last: float, count: int) -> np.ndarray:
    """
    Return ``count`` sines one after the other, without a jump of phase; the largest is 1.

    Their frequencies, Hz, go from first to last in equal ratios; their sizes rise and fall in
    turns, so that slow and fast ones are both small and large.
    """
    place = np.minimum((time / time[-1] * count).astype(int), count - 1)
    tone = np.geomspace(first, last, count)[place]
    size = np.linspace(1.0, 0.3, count)[(place * 2) % count]
    return size * np.sin(2.0 * np.pi * np.cumsum(tone) * (time[1] - time[0]))


def set_off(time: np.ndarray, ease: float = LEAD) -> np.ndarray:
    """Return the seconds of a clock that sets off from rest and is in step after ``ease`` s."""
    x = np.clip(time / ease, 0.0, 1.0)
    return np.where(time < ease, ease * x**3 * (1.0 - 0.5 * x), time - 0.5 * ease)
