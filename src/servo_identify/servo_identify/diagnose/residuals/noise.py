"""
The noise of the readings of one recording.

A reading holds the motion and the noise of its sensor. Differences of fourth order leave the
noise, for a motion is smooth. A current in a closed loop is not: the controller answers the noise
of the encoder, and the current follows for true. What the drive makes of the command is therefore
taken off first.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from servo_twin.recording.recording import Recording

from ...data.signals import ANGLES
from ...data.white_noise import FOURTH, QUARTILE

ALIKE = 0.01  # share of a count by which a step may miss a multiple of it
MULTIPLES = 0.9  # share of the steps that are multiples of a count
SMALLEST = 1e-3  # of the largest step, above which one is no matter of rounded digits
ROUNDED = 4.0  # digits by which second differences of a rounded reading may be off


def noise_of(x: np.ndarray) -> float:
    """
    Estimate the standard deviation of white noise on a smooth signal, in its unit.

    The median keeps steps and reversals out. A reading in counts has at least the noise of
    rounding to the count.
    """
    x = x[np.isfinite(x)]
    if len(x) < 16:
        return 0.0
    fourth = np.diff(x, 4)
    spread = float(np.median(np.abs(fourth))) / (QUARTILE * FOURTH)
    rounded = count_of(x) / np.sqrt(12.0)
    if spread == rounded == 0.0:  # mostly at rest, or resampled: what moves tells
        return float(np.std(fourth)) / FOURTH
    return max(spread, rounded)


def count_of(x: np.ndarray) -> float:
    """
    Return the count of a reading, in its unit; 0 where it is not in counts.

    It is the smallest step of which nearly all are multiples. A table rounds counts to decimals,
    or to digits that are fewer for large numbers: steps that this leaves lie far below the count.
    """
    x = x[np.isfinite(x)]
    steps = np.abs(np.diff(x, 2))
    steps = np.sort(steps[steps > 1e-9 * np.abs(x).max(initial=0.0)])
    ends = np.flatnonzero(steps[1:] > 4.0 * ROUNDED * steps[:-1]) + 1
    for first in ends[::-1]:
        count = _least(steps, first, ROUNDED * steps[first - 1])
        if count:
            return count
    return _commonest(steps) or _least(steps, 0, 0.0)


def _least(steps: np.ndarray, first: int, off: float) -> float:
    """
    Return the least of sorted steps from the ``first`` on, where nearly all are multiples of it.

    They may miss one by ``off``, or where that is zero by a share; 0 where they do not.
    """
    rest = steps[first:]
    if len(rest) < 16:
        return 0.0
    count = float(np.percentile(rest, 1))
    count = float(rest[rest < 1.5 * count].mean())
    return count if np.mean(_missed(steps, count) <= (off or ALIKE * count)) > MULTIPLES else 0.0


def _missed(steps: np.ndarray, count: float) -> np.ndarray:
    return np.abs(steps - count * np.round(steps / count))


def _commonest(steps: np.ndarray) -> float:
    """
    Return the commonest of sorted steps where nearly all are multiples of it, else 0.

    It is the count of a reading of which some rows were made up, with steps of any size.
    """
    large = steps[steps > SMALLEST * steps.max(initial=0.0)]
    if len(large) < 16:
        return 0.0
    place = np.round(np.log(large) / ALIKE).astype(int)
    number, times = np.unique(place, return_counts=True)
    count = float(np.median(large[place == number[np.argmax(times)]]))
    whole = _missed(steps, count) <= ALIKE * count
    if np.mean(whole) <= MULTIPLES:
        return 0.0
    some = steps[whole & (steps > 0.5 * count)]
    return float(np.median(some / np.round(some / count)))


def of_encoders(noises: Sequence[dict[str, float]]) -> list[dict[str, float]]:
    """
    Return the noise of each channel by recording, where an encoder has one noise in all of them.

    A shaft that rests on one count shows none; it has no less than in most recordings.
    """
    usual = {name: np.nanmedian(several) for name in ANGLES
             for several in [[one[name] for one in noises]] if not np.isnan(several).all()}
    return [one | {name: max(one[name], least) for name, least in usual.items()
                   if not np.isnan(one[name])} for one in noises]


def one_count(counts: Sequence[dict[str, float]]) -> list[dict[str, float]]:
    """
    Return the count of each angle by recording, where an encoder has one count in all of them.

    Rows that were made up between others hide it, so that a recording without one has the others'.
    """
    usual = {name: float(np.median([one[name] for one in counts if one[name]] or [0.0]))
             for name in ANGLES}
    return [{name: one[name] or usual[name] for name in ANGLES} for one in counts]


def noises_of(recording: Recording, drive_current: np.ndarray | None = None) -> dict[str, float]:
    """
    Return the noise of each channel by name, NaN where it is not measured.

    ``drive_current`` is what the drive makes of the command, A: the smaller of the noise of the
    current and that of its difference to this is the sensor's.
    """
    noise = {name: noise_of(recording[name]) if recording.has(name) else np.nan
             for name in (*ANGLES, 'torque', 'current', 'voltage')}
    if drive_current is not None and recording.has('current'):
        noise['current'] = min(noise['current'], noise_of(recording['current'] - drive_current))
    return noise
