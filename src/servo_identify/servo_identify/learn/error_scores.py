"""Figures of merit, each defined once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Scores:
    """Errors of a prediction; ``mape`` in percent, the others in the target's unit."""

    mse: float
    rmse: float
    mae: float
    mape: float
    r2: float


def scores_of(measured: np.ndarray, predicted: np.ndarray) -> Scores:
    """
    Return mean square, root mean square, mean absolute and mean absolute percentage error and R2.

    The percentage leaves out rows below a thousandth of the largest, where it means nothing.
    """
    error = np.asarray(predicted) - np.asarray(measured)
    mse = float(np.mean(error**2))
    large = np.abs(measured) > 1e-3 * np.max(np.abs(measured))
    spread = float(np.sum((measured - np.mean(measured)) ** 2))
    return Scores(mse, mse**0.5, float(np.mean(np.abs(error))),
                  float(100.0 * np.mean(np.abs(error[large] / measured[large]))),
                  1.0 - float(np.sum(error**2)) / max(spread, 1e-300))


def goodness_of_fit(measured: np.ndarray, predicted: np.ndarray) -> float:
    """Paper 000 eq. 13: one less the root of the ratio of squared error to squared signal."""
    return 1.0 - float(np.sqrt(np.sum((measured - predicted) ** 2) / np.sum(measured**2)))
