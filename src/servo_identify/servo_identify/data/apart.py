"""By how much a value differs between recordings, where that is no chance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp

import numpy as np
from scipy.stats import chi2

from .mistakes import MISTAKE


@dataclass(frozen=True)
class Chance:
    """
    What may make recordings differ: chance, below ``sure``, the ``noise`` of a reading, a doubt.

    ``doubt`` is by what they may be off together, (recordings,). ``where`` the values hold.
    """

    names: Sequence[str]
    sure: float
    noise: float
    doubt: np.ndarray
    where: str = ''


@dataclass(frozen=True)
class Difference:
    """By how much the value of one recording is above that of another."""

    far: float
    error: float
    low: str
    high: str
    where: str

    def said(self, unit: str, scale: float = 1.0) -> str:
        """Say it, times ``scale``, which brings it to where it is read."""
        return (f'{self.high} has {scale * self.far:.3g} +- {scale * self.error:.1g} {unit} more '
                f'than {self.low}{self.where}')


def most_apart(apart: np.ndarray, covariance: np.ndarray, chance: Chance) -> Difference | None:
    """Return the largest difference of values with their covariance, None if it may be chance."""
    together = chance.doubt - np.mean(chance.doubt)
    covariance = covariance + np.outer(together, together)
    if not np.isfinite(covariance).all() or not covariance.any():
        return None
    spread = float(apart @ np.linalg.pinv(covariance, 1e-9, True) @ apart)
    low, high = int(np.argmin(apart)), int(np.argmax(apart))
    pair = np.zeros(len(apart))
    pair[[low, high]] = -1.0, 1.0
    far, error = float(pair @ apart), float(np.sqrt(pair @ covariance @ pair))
    if far < chance.noise or chi2.sf(spread, len(apart) - 1) >= exp(-chance.sure - MISTAKE):
        return None
    return Difference(far, error, chance.names[low], chance.names[high], chance.where)
