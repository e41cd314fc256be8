"""
Balance equations without differentiating noise.

A balance like ``K i - J w' - T = 0`` is multiplied by a smooth bump and integrated; the
derivatives move over to the bump, whose own derivatives are exact. Every term of a balance passes
the same bump, so that nothing of the processing is left in the difference.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import BSpline

DEGREE = 5


@lru_cache(maxsize=64)
def taps(spacing: int, order: int) -> np.ndarray:
    """
    Return the quintic bump with knots every ``spacing`` samples, or a derivative of it.

    Shape (6 * spacing - 1,), in samples: divide by period**order. The bump sums to one.
    """
    bump = BSpline.basis_element(np.arange(DEGREE + 2), extrapolate=False)
    at = np.arange(1, (DEGREE + 1) * spacing) / spacing
    values = bump.derivative(order)(at) if order else bump(at)
    return np.nan_to_num(values) / spacing ** (1 + order)


@lru_cache(maxsize=64)
def flat_taps(spacing: int, order: int) -> np.ndarray:
    """
    Return the bump (or its first derivative) with its second moment taken out, in samples.

    It lets pass unchanged what the plain bump lets pass within a few percent, so that a law asked
    for this motion and weighed once more is weighed once and not twice.
    """
    plain, curved = taps(spacing, order), taps(spacing, order + 2)
    at = np.arange(len(plain)) - len(plain) // 2
    spread = float((taps(spacing, 0) * at**2).sum())
    return plain - 0.5 * spread * curved


@dataclass(frozen=True)
class Bump:
    """
    The test function at one period and spacing, read out every ``stride`` samples.

    ``weigh(x, order)`` integrates the order-th derivative of ``x`` (shape (samples,)) against it.
    """

    spacing: int
    period: float
    stride: int

    @property
    def reach(self) -> int:
        """Samples to either side of the centre."""
        return 3 * self.spacing - 1

    def centres(self, samples: int) -> np.ndarray:
        """Samples that are centres, as indices."""
        return np.arange(self.reach, samples - self.reach, self.stride)

    def weigh(self, x: np.ndarray, order: int = 0, every: bool = False) -> np.ndarray:
        """
        Weigh ``x`` or a derivative of it, at the centres or at every sample that has full reach.

        Unit: that of ``x`` over s**order. A NaN under the bump makes the result NaN.
        """
        kernel = taps(self.spacing, order) * ((-1.0) ** order / self.period ** order)
        windows = np.lib.stride_tricks.sliding_window_view(x, len(kernel))
        if not every:
            windows = windows[:: self.stride]
        return windows @ kernel

    def smooth(self, x: np.ndarray, order: int = 0) -> np.ndarray:
        """Smooth ``x`` (or its first derivative) at every sample that has full reach."""
        kernel = flat_taps(self.spacing, order) * ((-1.0) ** order / self.period ** order)
        return np.lib.stride_tricks.sliding_window_view(x, len(kernel)) @ kernel

    def gain(self, order: int = 0) -> float:
        """Standard deviation of the weighed white noise of standard deviation one."""
        return float(np.sqrt((taps(self.spacing, order) ** 2).sum()) / self.period ** order)


def noise_of(x: np.ndarray) -> float:
    """
    Estimate the standard deviation of the white noise on a smooth signal, in its unit.

    By fourth differences, which a smooth signal does not survive; the median keeps steps and
    reversals out. A reading in counts has at least the noise of rounding to the count.
    """
    x = x[np.isfinite(x)]
    if len(x) < 16:
        return 0.0
    fourth = np.diff(x, 4)
    spread = float(np.median(np.abs(fourth))) / (0.6745 * np.sqrt(70.0))
    rounded = count_of(x) / np.sqrt(12.0)
    if spread == rounded == 0.0:  # mostly at rest, or resampled: what moves tells
        return float(np.std(fourth)) / np.sqrt(70.0)
    return max(spread, rounded)


def count_of(x: np.ndarray) -> float:
    """Return the count of a reading, in its unit; 0 where it is not in counts."""
    x = x[np.isfinite(x)]
    steps = np.abs(np.diff(x, 2))
    steps = steps[steps > 1e-9 * np.abs(x).max(initial=0.0)]
    if len(steps) < 16:
        return 0.0
    count = float(np.percentile(steps, 1))
    whole = np.abs(steps / count - np.round(steps / count)) < 0.01
    return count if np.mean(whole) > 0.9 else 0.0
