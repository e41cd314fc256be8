"""The spectrum of what is left between a rig and its twin."""

from __future__ import annotations

import numpy as np

SEGMENT = 2.0  # s, longest segment that is averaged
POINTS = 400  # frequencies that are drawn


def spectrum(values: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """
    Return frequencies in Hz and the amplitude spectral density, unit of the values / sqrt(Hz).

    Welch's method (Hann window, half overlapped segments of at most SEGMENT s) over the last
    samples without a gap; the largest of neighbouring frequencies is kept, so no line is lost.
    Both are empty where fewer than 64 samples follow each other.
    """
    from scipy.signal import welch

    known = np.flatnonzero(np.isfinite(values))
    if len(known):
        last = np.flatnonzero(np.diff(known) > 1)
        values = values[known[last[-1] + 1 if len(last) else 0]:known[-1] + 1]
    else:
        values = values[:0]
    if len(values) < 64:
        return np.empty(0), np.empty(0)
    size = min(len(values), round(SEGMENT / period))
    frequency, power = welch(values, 1.0 / period, nperseg=size)
    frequency, density = frequency[1:], np.sqrt(power[1:])
    edges = np.unique(np.geomspace(1, len(frequency) + 1, POINTS + 1).astype(int)) - 1
    most = np.maximum.reduceat(density, edges[:-1])
    return frequency[edges[:-1]], most
