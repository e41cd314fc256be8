r"""
Recursive least squares that forgets by time, and only what it learns again.

With information :math:`R`, regressor :math:`\varphi` and variance :math:`\sigma^2` of a row,

.. math:: R \leftarrow R - (1 - \lambda)\frac{R\varphi\varphi^T R}{\varphi^T R\varphi}
   + \varphi\varphi^T, \quad \lambda = e^{-p\,\Delta t/\tau}

(directional forgetting: Cao, Schwartz, Automatica 36, 2000): what a row says nothing about keeps
its information, so that nothing winds up while the excitation is poor; each row forgets in one
direction of :math:`p`, hence the :math:`p`. :math:`\sigma^2` is the
mean square of the innovations, forgotten with the same :math:`\tau`; their correlation
:math:`\rho` from one row to the next widens the variance by :math:`(1 + \rho)/(1 - \rho)`, as for
an autoregression of order one. Values lag a drift by about :math:`\tau`.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

import numpy as np

_SLOWEST = 0.98  # correlation beyond which rows are no longer taken apart


class Tracker:
    """
    Tracks the factors of a linear law.

    The bounds hold what it answers, not what it tracks: a factor beyond its bound does not bend
    the others.
    ``start`` and ``doubt`` (p,): first values and standard deviations; ``bounds`` (p, 2);
    ``noise``: first guess of the standard deviation of a row.
    """

    def __init__(self, start: Sequence[float], doubt: Sequence[float],
                 bounds: Sequence[tuple[float, float]], noise: float) -> None:
        self.bounds = np.array(bounds, dtype=float)
        self._free = np.array(start, dtype=float)
        self.rows = 0
        self._variance = noise ** 2
        self._weight = 1.0
        self._information = np.diag(self._variance / np.square(np.array(doubt, dtype=float)))
        self._shared = 0.0
        self._before = 0.0

    @property
    def values(self) -> np.ndarray:
        """The factors (p,), within their bounds."""
        return np.clip(self._free, *self.bounds.T)

    @property
    def std(self) -> np.ndarray:
        """One standard deviation of each value."""
        correlation = min(max(self._shared / self._variance, 0.0), _SLOWEST)
        wider = (1.0 + correlation) / (1.0 - correlation)
        return np.sqrt(self._variance * wider * np.diag(np.linalg.inv(self._information)))

    @property
    def bounded(self) -> np.ndarray:
        """Where a value stands at a bound."""
        return (self._free <= self.bounds[:, 0]) | (self._free >= self.bounds[:, 1])

    def take(self, regressor: Sequence[float], answer: float, seconds: float,
             time_constant: float) -> None:
        """Take a row that stands for ``seconds`` of excitation, with ``answer`` in its unit."""
        phi = np.asarray(regressor, dtype=float)
        forget = 1.0 - exp(-len(phi) * seconds / time_constant)
        known = self._information @ phi
        gain = float(phi @ known)
        if gain > 0.0:
            self._information -= forget * np.outer(known, known) / gain
        self._information += np.outer(phi, phi)
        covariance = np.linalg.inv(self._information)
        error = answer - float(phi @ self._free)
        self._free = self._free + covariance @ phi * error
        left = answer - float(phi @ self._free)
        self._weight = self._weight * exp(-seconds / time_constant) + 1.0
        share = 1.0 / self._weight
        self._variance += share * (abs(error * left) - self._variance)
        self._shared += share * (left * self._before - self._shared)
        self._before = left
        self.rows += 1
