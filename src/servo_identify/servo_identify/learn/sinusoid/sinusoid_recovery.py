r"""
Frequency, phase, amplitude and offset of a sinusoid from its samples.

As paper 002 section 4 does it: the spectrum says where the frequency is; a constrained
optimisation of

.. math:: \sum_k \left(y_k - c - a \sin(2\pi f t_k + \varphi)\right)^2

about it finds the phase and corrects the frequency. The spectrum is that of the record through a
Hann window, padded with zeros; a parabola through the logarithms of the three highest lines places
the peak between them (the estimator of Gasior and Gonzalez, 2004). The optimisation may leave the
peak by one line of the unpadded spectrum, which is more than a window can be wrong by.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, pi, remainder, sqrt

import numpy as np
from scipy.optimize import least_squares

PADDING = 8  # lines of the padded spectrum for one of the record's own
LEAST_PERIODS = 0.75  # of the sinusoid in the record, below which offset and sine are one
LEAST_SAMPLES = 16
TRIALS = 9  # frequencies between the bounds from which the best one is refined


class SinusoidError(ValueError):
    """A record in which no sinusoid can be found; says why."""


@dataclass(frozen=True)
class Sinusoid:
    """
    ``offset + amplitude sin(2 pi frequency t + phase)``, t in s from the first sample.

    ``amplitude`` is positive, ``phase`` in (-pi, pi] rad. ``*_std``: one standard error, as if
    the residuals were independent. ``residual`` is their root mean square, in the unit of the
    record; ``explained`` the share of the record's variance that the sinusoid is. ``peak``, Hz:
    where the spectrum alone puts the frequency.
    """

    offset: float
    amplitude: float
    frequency: float
    phase: float
    offset_std: float
    amplitude_std: float
    frequency_std: float
    phase_std: float
    residual: float
    explained: float
    peak: float
    samples: int

    def __call__(self, t: np.ndarray) -> np.ndarray:
        """Return the sinusoid at instants ``t``, s."""
        return self.offset + self.amplitude * np.sin(
            2.0 * pi * self.frequency * np.asarray(t) + self.phase)


def recovered(signal: np.ndarray, period: float) -> Sinusoid:
    """
    Recover the sinusoid that a record holds; samples that are NaN are left out.

    ``signal`` (n,), in any unit, sampled every ``period`` s. Raises SinusoidError where the record
    is too short, constant or holds too small a part of one period.
    """
    signal = np.asarray(signal, float)
    known = np.isfinite(signal)
    if known.sum() < LEAST_SAMPLES:
        raise SinusoidError(f'the record has {known.sum()} samples that are numbers; a sinusoid '
                            f'needs {LEAST_SAMPLES}')
    t = np.arange(len(signal)) * period
    y, at = signal[known], t[known]
    if np.ptp(y) <= 1e-12 * max(1.0, abs(y[0])):
        raise SinusoidError(f'the record is constant ({y[0]:.6g}); there is no sinusoid in it')
    even = np.arange(round(at[0] / period), round(at[-1] / period) + 1) * period
    length = len(even) * period
    peak = _peak(np.interp(even, at, y), period)
    low, high = max(0.5 / length, peak - 1.0 / length), min(0.5 / period, peak + 1.0 / length)
    middle = 0.5 * (at[0] + at[-1])  # about it frequency and phase hardly depend on each other
    found = _optimised(at - middle, y, low, high, peak, middle)
    if found.frequency * length < LEAST_PERIODS:
        raise SinusoidError(f'the record holds {found.frequency * length:.2f} periods of '
                            f'{found.frequency:.4g} Hz; {LEAST_PERIODS} are needed to tell a '
                            'sinusoid from an offset')
    return found


def _peak(y: np.ndarray, period: float) -> float:
    """Return the frequency of the highest line of the spectrum, Hz, between the lines."""
    count = 1 << int(np.ceil(np.log2(PADDING * len(y))))
    power = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(len(y)), count))
    first = max(1, count // (2 * len(y)))  # what is slower than half a line is drift
    k = first + int(np.argmax(power[first:-1]))
    left, top, right = np.log(np.maximum(power[k - 1:k + 2], 1e-300))
    bend = left - 2.0 * top + right
    shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return (k + min(max(shift, -0.5), 0.5)) / (count * period)


def _linear(t: np.ndarray, y: np.ndarray, frequency: float) -> tuple[np.ndarray, float]:
    """Return offset, sine and cosine amplitude at a frequency, and the squared error left."""
    angle = 2.0 * pi * frequency * t
    design = np.column_stack([np.ones(len(t)), np.sin(angle), np.cos(angle)])
    found = np.linalg.lstsq(design, y, rcond=None)[0]
    return found, float(np.sum((y - design @ found) ** 2))


def _optimised(t: np.ndarray, y: np.ndarray, low: float, high: float, peak: float,
               middle: float) -> Sinusoid:
    trials = [min(max(peak, low), high), *np.linspace(low, high, TRIALS)]
    start = min(trials, key=lambda f: _linear(t, y, f)[1])
    offset, sine, cosine = _linear(t, y, start)[0]
    width = (high - low) or 1.0
    size = max(sqrt(sine ** 2 + cosine ** 2), 1e-12 * np.ptp(y))

    # unknowns of size one: offset, amplitude, frequency within its bounds, phase
    def wave(x: np.ndarray) -> np.ndarray:
        return 2.0 * pi * (low + width * x[2]) * t + x[3]

    def residual(x: np.ndarray) -> np.ndarray:
        return x[0] + x[1] * np.sin(wave(x)) - y / size

    def slope(x: np.ndarray) -> np.ndarray:
        angle = wave(x)
        cosine = x[1] * np.cos(angle)
        return np.column_stack([np.ones(len(t)), np.sin(angle), cosine * 2.0 * pi * width * t,
                                cosine])

    phase = atan2(cosine, sine)
    begun = np.array([offset / size, 1.0, (start - low) / width, phase])
    found = least_squares(residual, np.clip(begun, [-np.inf, 0.0, 0.0, -np.inf],
                                            [np.inf, np.inf, 1.0, np.inf]), slope,
                          bounds=([-np.inf, 0.0, 0.0, phase - pi],
                                  [np.inf, np.inf, 1.0, phase + pi]),
                          xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=200)
    left = float(np.mean(found.fun ** 2))
    jacobian = found.jac
    spread = np.linalg.pinv(jacobian.T @ jacobian) * left * len(t) / max(1, len(t) - 4)
    at_start = np.array([0.0, 0.0, -2.0 * pi * width * middle, 1.0])  # of the phase at t = 0
    std = np.sqrt(np.maximum(np.diag(spread), 0.0))
    frequency = low + width * found.x[2]
    begin = remainder(found.x[3] - 2.0 * pi * frequency * middle, 2.0 * pi)
    return Sinusoid(
        float(found.x[0] * size), float(found.x[1] * size), float(frequency), begin,
        float(std[0] * size), float(std[1] * size), float(std[2] * width),
        sqrt(max(float(at_start @ spread @ at_start), 0.0)), sqrt(left) * size,
        1.0 - left * size ** 2 / float(np.var(y)), peak, len(y))
