r"""
A frequency response estimated from a recording: H1 by Welch's averaged spectra, with coherence.

.. math:: \hat H_1 = \frac{\hat S_{uy}}{\hat S_{uu}}, \quad
          \gamma^2 = \frac{|\hat S_{uy}|^2}{\hat S_{uu}\hat S_{yy}}

Right where noise is on the output alone and the input does not follow it; in a closed loop H1 from
the command is drawn toward minus the inverse of the controller where noise rules. Source: Bendat,
Piersol: Random Data, 2010, sec. 6.1 and 9.1; Welch: IEEE Trans. Audio 15(2), 1967.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from ..physics.servo import ServoError
from ..recording.recording import Recording

CLEAR = 0.8
"""Coherence above which a point of the estimate is compared with the model."""

_SEGMENTS = 16  # about as many averages, where no length is told
_FLOOR = 1e-4  # of the strongest line of the input: below, nothing was excited
_PROMINENT = np.log(10.0) * 3.0 / 20.0
_SPEEDS = {'motor_speed': 'motor_position', 'load_speed': 'load_position'}


@dataclass(frozen=True)
class Measured:
    """
    A frequency response of a recording.

    ``frequency`` in Hz, ``response`` complex, ``coherence`` from 0 to 1, all of shape (n,);
    ``averages`` segments of ``segment`` s; ``period`` of the samples in s.
    """

    frequency: np.ndarray
    response: np.ndarray
    coherence: np.ndarray
    averages: int
    segment: float
    period: float

    @property
    def clear(self) -> np.ndarray:
        """Which points are coherent enough to be believed, bool (n,)."""
        return self.coherence >= CLEAR


def estimate(recording: Recording, input: str, output: str, segment: float = 0.0) -> Measured:
    """
    Return the response from a column of a recording to another one, or to a speed.

    ``segment``: length in s of what is averaged, half overlapping under a Hann window; 0: a
    sixteenth of the recording, at most. Angles are estimated by their differences, so that a
    drift does no harm, and a speed is the angle's response times j omega. Frequencies that the
    input hardly holds are left out. Raises ServoError for a column that was not recorded, or that
    stands still.
    """
    column = _SPEEDS.get(output, output)
    for name in (input, column):
        if not recording.has(name):
            known = [n for n in recording.columns if recording.has(n)]
            raise ServoError(f'{recording.name}: {name} was not recorded; there are {known}')
    u, y = _whole(recording, input, column)
    period = recording.period
    angle = column.endswith('position')
    if angle:
        u, y = u[1:], np.diff(y) / period
    length = _length(len(u), period, segment, recording.name)
    settings = {'fs': 1.0 / period, 'window': 'hann', 'nperseg': length, 'detrend': 'linear'}
    frequency, own = signal.welch(u, **settings)
    _, cross = signal.csd(u, y, **settings)
    _, other = signal.welch(y, **settings)
    held = (own > _FLOOR * own.max()) & (frequency > 1.5 / (length * period))
    if not own.max() > 1e-20 or not held.any():
        raise ServoError(f'{recording.name}: {input} stands still, there is nothing to estimate '
                         f'from')
    frequency, own, cross, other = (row[held] for row in (frequency, own, cross, other))
    response = cross / own
    with np.errstate(divide='ignore', invalid='ignore'):
        coherence = np.nan_to_num(np.abs(cross) ** 2 / (own * other))
    if angle:
        turn = 2j * np.pi * frequency
        response *= period / (1.0 - np.exp(-turn * period))  # a sum undoes the difference
        if output in _SPEEDS:
            response *= turn
    averages = max(1, 2 * len(u) // length - 1)
    return Measured(frequency, response, coherence, averages, length * period, period)


def _whole(recording: Recording, *columns: str) -> tuple[np.ndarray, ...]:
    """Return columns without the ends at which one of them was lost, gaps filled straight."""
    kept = np.all([np.isfinite(recording[name]) for name in columns], axis=0)
    known = np.flatnonzero(kept)
    inside = np.arange(known[0], known[-1] + 1) if len(known) else known
    return tuple(np.interp(inside, known, recording[name][known]) for name in columns)


def _length(samples: int, period: float, segment: float, name: str) -> int:
    if segment <= 0.0:
        return max(8, 2 * samples // (_SEGMENTS + 1))
    length = round(segment / period)
    if not 8 <= length <= samples:
        raise ServoError(f'{name}: a segment of {segment:g} s is not between {8 * period:g} and '
                         f'{samples * period:g} s')
    return length


def extremes(measured: Measured) -> tuple[float, float]:
    """
    Return the frequencies in Hz of the measured antiresonance and resonance; NaN without one.

    The highest peak of the coherent response times the frequency (as of an acceleration), and the
    lowest dip below it, each of 3 dB or more, at the top of a parabola through the logarithms of
    three points.
    """
    found = measured.frequency[measured.clear]
    size = np.log(np.abs(measured.response[measured.clear]) * np.maximum(found, 1e-9))
    peaks, dips = (signal.find_peaks(sign * size, prominence=_PROMINENT)[0] for sign in (1, -1))
    if not len(peaks):
        return float('nan'), float('nan')
    top = int(peaks[np.argmax(size[peaks])])
    dips = dips[dips < top]
    low = _summit(found, size, int(dips[np.argmin(size[dips])])) if len(dips) else float('nan')
    return low, _summit(found, size, top)


def _summit(frequency: np.ndarray, size: np.ndarray, at: int) -> float:
    a, b, c = size[at - 1:at + 2]
    return float(frequency[at] + 0.25 * (frequency[at + 1] - frequency[at - 1])
                 * (a - c) / (a - 2.0 * b + c))
