"""What recordings can tell: standard errors that do not assume independence."""

from __future__ import annotations

import numpy as np

from .fit_problem import Normal


def spread(normal: Normal, owner: np.ndarray, held: np.ndarray, known: np.ndarray | None = None,
           settled: bool = True, lag: int = 2) -> np.ndarray:
    r"""
    Return the covariance (p, p) of the shared numbers, in units of their scales.

    .. math:: C = (H + P)^{-1} (M + P) (H + P)^{-1}

    H is the curvature of the cost, M the scatter of its slopes, and P = diag(``known``) (p,) what
    is known of each number without the recordings, one over its variance; nothing by default.

    A sandwich over horizons: their scores are summed with Bartlett weights up to ``lag``
    neighbours of the same recording (Newey, West 1987), so errors may be correlated within
    horizons and between neighbours. Where the horizons are too few for that, it is the classical
    one, widened by the correlation time of the residuals and to the larger deviations of the two:
    few scores span few directions, and would call all numbers one. ``settled`` adds the step that
    is left to go. Held numbers get NaN.
    """
    p = len(held)
    free = np.flatnonzero(~held)
    covariance = np.full((p, p), np.nan)
    if not len(free):
        return covariance
    prior = np.zeros(len(free)) if known is None else known[free]
    bread = np.linalg.pinv(normal.hessian[np.ix_(free, free)] + np.diag(prior), rcond=1e-13,
                           hermitian=True)
    scores = normal.scores[:, free]
    meat = scores.T @ scores
    for gap in range(1, min(lag, len(scores) - 1) + 1):
        same = owner[gap:] == owner[:-gap]
        pair = (scores[gap:] * same[:, None]).T @ scores[:-gap]
        meat += (1.0 - gap / (lag + 1.0)) * (pair + pair.T)
    blocks = len(scores)
    meat *= blocks / max(1.0, blocks - len(free))
    sandwich = bread @ (meat + np.diag(prior)) @ bread
    residual = normal.residual
    used = np.count_nonzero(residual)
    level = np.sum(residual**2) / max(1, used - p) * _correlation_time(residual)
    classical = level * bread
    covariance[np.ix_(free, free)] = sandwich if blocks >= 10 * len(free) else cautious(
        classical, sandwich)
    # what the linear model still promises and kinks of friction did not let the fit have
    if settled:
        step = bread @ normal.gradient[free]
        covariance[np.ix_(free, free)] += np.outer(step, step)
    return covariance


def cautious(fine: np.ndarray, coarse: np.ndarray) -> np.ndarray:
    """Return the fine covariance, widened where the coarse one is wider."""
    grow = _wider(fine, coarse)
    return fine * np.outer(grow, grow)


def _wider(fine: np.ndarray, coarse: np.ndarray) -> np.ndarray:
    """Return by what each standard deviation of a covariance grows to be that of another."""
    own, other = np.diag(fine), np.diag(coarse)
    return np.sqrt(np.maximum(1.0, other / np.maximum(own, 1e-15 * other + 1e-300)))


def _correlation_time(residual: np.ndarray) -> float:
    """Samples over which residuals stay alike: 1 + 2 sum of the autocorrelation, by energy."""
    energy = np.sum(residual**2, axis=0)
    total = 0.0
    for c in np.flatnonzero(energy):
        size = 1 << (2 * len(residual) - 1).bit_length()
        spectrum = np.fft.rfft(residual[:, c], size)
        auto = np.fft.irfft(spectrum * spectrum.conj(), size)[:len(residual) // 2] / energy[c]
        below = np.flatnonzero(auto < 0.05)
        stop = below[0] if len(below) else len(auto)
        total += energy[c] * (1.0 + 2.0 * auto[1:stop].sum())
    return max(1.0, total / max(energy.sum(), 1e-300))
