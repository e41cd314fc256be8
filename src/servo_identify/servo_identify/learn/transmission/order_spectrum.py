"""
Order spectra, and how many orders the data carry.

An order is a frequency per turn of the load (paper 000 eq. 11). Where the whole turn was passed
the spectrum is a Fourier transform over the turn; amplitude and phase of each order are those of
eq. 12.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .turn_passes import angles

MATTERS = 5e-4


def amplitudes(lost: np.ndarray) -> np.ndarray:
    """Return complex amplitudes c of orders 0, 1, 2 ..., for sum Re(c exp(-i E theta))."""
    cells = len(lost)
    known = np.isfinite(lost)
    grid = np.arange(cells)
    whole = np.interp(grid, grid[known], lost[known], period=cells)
    spectrum = np.fft.rfft(whole) / cells * 2.0
    orders = np.arange(len(spectrum))
    # the first cell's middle is half a cell after angle zero
    return np.conj(spectrum * np.exp(-1j * orders * np.pi / cells))


def rebuilt(spectrum: np.ndarray, orders: Sequence[int], cells: int) -> np.ndarray:
    """Return what some orders make, at the middle of each cell."""
    at = angles(cells)
    total = np.zeros(cells)
    for order in orders:
        c = spectrum[order]
        total += c.real * np.cos(order * at) + c.imag * np.sin(order * at)
    return total


def dominant(passes: Sequence[np.ndarray], most: int = 60) -> list[int]:
    """
    Return the orders that repeat from pass to pass, largest first; their number by the data.

    An order is kept where it lowers the squared error of predicting a pass from the mean of the
    others by four times its own scatter. It also has to carry more than :data:`MATTERS` of the
    energy. The scatter is by cross-validation over whole passes, so correlated residuals within a
    pass do not count as evidence. With one pass the floor is five times the median amplitude.
    """
    spectra = np.array([amplitudes(p) for p in passes])
    mean = spectra.mean(axis=0)
    mean[0] = 0.0
    ranked = np.argsort(-np.abs(mean))[:most]
    energy = np.abs(mean) ** 2
    if len(spectra) < 2:
        floor = max(5.0 * np.median(np.abs(mean[1:])), np.sqrt(MATTERS * energy.sum()))
        return [int(o) for o in ranked if abs(mean[o]) > floor]
    count = len(spectra)
    others = (spectra.sum(axis=0)[None, :] - spectra) / (count - 1)
    gain = np.sum(np.abs(spectra) ** 2 - np.abs(spectra - others) ** 2, axis=0)
    noise = np.sum(np.abs(spectra - mean) ** 2, axis=0)
    return [int(o) for o in ranked
            if gain[o] > 4.0 * noise[o] and energy[o] > MATTERS * energy.sum()]


def invariance(passes: Sequence[np.ndarray], orders: Sequence[int]) -> dict[int, float]:
    """
    Return how far each order keeps its amplitude and phase over passes: 1 the same, 0 unrelated.

    The length of the mean complex amplitude over the root mean square of the lengths. If orders
    were frequencies in time, passes at other speeds would not agree (paper 000 eq. 10 to 12).
    """
    spectra = np.array([amplitudes(p) for p in passes])
    return {o: float(np.abs(spectra[:, o].mean())
                     / max(np.sqrt(np.mean(np.abs(spectra[:, o]) ** 2)), 1e-300)) for o in orders}
