"""Sparse regression over a library of friction terms (SINDy, by pysindy)."""

from __future__ import annotations

from numba import njit
import numpy as np

from ..friction_dataset import Dataset
from .friction_learner import Model, Told

TERMS = ('sgn(w)', 'w', 'w |w|', 'w^3', 'sgn(w) exp(-(w/w1)^2)', 'sgn(w) exp(-(w/w2)^2)',
         'tanh(w/w3)', 'a', 'a |w|', 'i', 'i |w|', '|i| sgn(w)', '1')
THRESHOLDS = (0.3, 0.1, 0.03, 0.01, 0.003)


@njit(cache=True)
def library(w, a, i, top):
    """Return the terms at each sample, shape (samples, terms); ``top`` scales the speeds."""
    out = np.empty((len(w), 13))
    for k in range(len(w)):
        s = 1.0 if w[k] > 0.0 else (-1.0 if w[k] < 0.0 else 0.0)
        v = w[k] / top
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = s, v, v * abs(v), v**3
        out[k, 4] = s * np.exp(-((v / 0.02) ** 2))
        out[k, 5] = s * np.exp(-((v / 0.1) ** 2))
        out[k, 6] = np.tanh(v / 0.01)
        out[k, 7], out[k, 8] = a[k], a[k] * abs(v)
        out[k, 9], out[k, 10], out[k, 11], out[k, 12] = i[k], i[k] * abs(v), abs(i[k]) * s, 1.0
    return out


def fitted(data: Dataset, seed: int, seconds: float, told: Told | None) -> Model:
    """Fit by sequentially thresholded least squares; the threshold by the validation rows."""
    from pysindy import STLSQ

    top = float(np.max(np.abs(data.features[data.train, 0])))

    def terms(rows: np.ndarray) -> np.ndarray:
        w, a, i = np.ascontiguousarray(data.features[rows].T)
        return library(w, a, i, top)

    train, kept = terms(data.train), terms(data.validation)
    size = np.maximum(train.std(axis=0), 1e-9)
    size[-1] = 1.0
    scale = float(data.target[data.train].std())
    best, best_loss = None, np.inf
    for step, threshold in enumerate(THRESHOLDS):
        optimiser = STLSQ(threshold=threshold, alpha=1e-6)
        optimiser.fit(train / size, (data.target[data.train] / scale)[:, None])
        weights = np.asarray(optimiser.coef_).ravel() * scale / size
        loss = float(np.mean((kept @ weights - data.target[data.validation]) ** 2))
        if told:
            told(step, threshold, loss)
        if loss < 0.98 * best_loss:  # a term more must be worth its while
            best, best_loss = weights, loss
    one = np.array([0.1])
    weights = best
    sentence = ' '.join(f'{v:+.3g} {t}' for v, t in zip(weights, TERMS, strict=True) if v)
    return Model('sindy', lambda d, rows: terms(rows) @ weights, int(np.count_nonzero(weights)),
                 lambda: (library(one, one, one, top) @ weights)[0],
                 f'{sentence}, w in units of {top:.3g} rad/s')


LEARNERS = {'sindy': fitted}
