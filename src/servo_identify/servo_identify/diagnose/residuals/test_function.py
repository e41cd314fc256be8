"""
Equations without differentiating noise.

An equation like ``K i - J w' - T = 0`` is multiplied by a smooth test function (a modulating
function) and integrated over its support. The derivatives move over to the test function, whose
own derivatives are exact. Every term passes the same test function, so that filtering leaves
nothing in the difference. Source: Shinbrot: Trans. ASME 79, 1957, modulating functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import BSpline
from scipy.ndimage import correlate1d

DEGREE = 5


@lru_cache(maxsize=64)
def taps(spacing: int, order: int) -> np.ndarray:
    """
    Return the quintic B-spline with knots every ``spacing`` samples, or a derivative of it.

    Shape (6 * spacing - 1,), in samples: divide by period**order. It sums to one.
    """
    spline = BSpline.basis_element(np.arange(DEGREE + 2), extrapolate=False)
    at = np.arange(1, (DEGREE + 1) * spacing) / spacing
    values = spline.derivative(order)(at) if order else spline(at)
    return np.nan_to_num(values) / spacing ** (1 + order)


@lru_cache(maxsize=64)
def flat_taps(spacing: int, order: int) -> np.ndarray:
    """
    Return the test function (or its first derivative) without its second moment, in samples.

    It passes unchanged what the plain one passes within a few percent. A friction law that is
    evaluated along a motion smoothed so, and then projected, is smoothed once and not twice.
    """
    plain, curved = taps(spacing, order), taps(spacing, order + 2)
    at = np.arange(len(plain)) - len(plain) // 2
    spread = float((taps(spacing, 0) * at**2).sum())
    return plain - 0.5 * spread * curved


@dataclass(frozen=True)
class TestFunction:
    """The test function at one period and spacing, read out every ``stride`` samples."""

    __test__ = False  # no test case, whatever pytest thinks of the name

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

    def project(self, x: np.ndarray, order: int = 0) -> np.ndarray:
        """
        Project ``x``, shape (samples,) or (samples, n), or a derivative of it, at the centres.

        Unit: that of ``x`` over s**order. A NaN under the test function makes the result NaN.
        """
        kernel = taps(self.spacing, order) * ((-1.0) ** order / self.period ** order)
        if len(x) < len(kernel):
            return np.zeros((0, *x.shape[1:]))
        windows = np.lib.stride_tricks.sliding_window_view(x, len(kernel), axis=0)
        return windows[:: self.stride] @ kernel

    def smooth(self, x: np.ndarray, order: int = 0) -> np.ndarray:
        """Smooth ``x`` or its first or second derivative at every sample of full reach."""
        shape = flat_taps if order < 2 else taps
        kernel = shape(self.spacing, order) * ((-1.0) ** order / self.period ** order)
        whole = correlate1d(x, kernel, mode='nearest')
        return whole[self.reach:len(x) - self.reach]

    def gain(self, order: int = 0) -> float:
        """Standard deviation of projected white noise of standard deviation one."""
        return float(np.sqrt((taps(self.spacing, order) ** 2).sum()) / self.period ** order)
