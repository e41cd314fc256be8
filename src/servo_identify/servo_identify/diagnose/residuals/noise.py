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

from ...data.encoder_count import count_of
from ...data.signals import ANGLES
from ...data.white_noise import FOURTH, QUARTILE


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
