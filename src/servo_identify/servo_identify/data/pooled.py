r"""
One least-squares fit over several recordings, in which each also has values of its own.

.. math:: y_r = S_r\,x + O_r\,z_r + e_r

with x shared by all recordings r and z of each alone. Neighbouring samples are alike, so that a
recording counts for :data:`.likelihood.SAMPLES` independent ones. What the equation lacks is
no chance: it pulls each stretch of a recording its own way, which the values show where one
stretch after another is left out (jackknife).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .likelihood import SAMPLES


@dataclass(frozen=True)
class Columns:
    """What one recording gives: ``seen`` (n,), ``shared`` (n, s) and ``own`` (n, o)."""

    seen: np.ndarray
    shared: np.ndarray
    own: np.ndarray


@dataclass(frozen=True)
class Pooled:
    """
    Values with their covariance: ``shared`` (s,), ``own`` (recordings, o), ``covariance`` of all.

    The covariance (s + recordings o, the same) has the shared values first. It holds no finite
    number where the recordings do not tell a value.
    """

    shared: np.ndarray
    own: np.ndarray
    covariance: np.ndarray

    def apart(self, weights: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """
        Return how far each recording is from the mean of all, (recordings,), in a sum of values.

        ``weights`` (o,) are those of its own values. Behind it the covariance of these
        differences, (recordings, recordings). An error that the shared values put into all of them
        alike is not in it.
        """
        count, shared = len(self.own), len(self.shared)
        told = self.own @ np.asarray(weights)
        used = np.tile(np.asarray(weights) != 0.0, count)  # of others nothing may be known
        of = np.kron(np.eye(count) - 1.0 / count, weights)[:, used]
        own = self.covariance[shared:, shared:][np.ix_(used, used)]
        return told - told.mean(), of @ own @ of.T


def pooled(several: Sequence[Columns], stretches: int = 1) -> Pooled:
    """
    Return the fit of recordings that all have the same columns.

    With ``stretches`` of each recording, more than one, the covariance also holds how far the
    values move where one of them is left out.
    """
    shared, own = several[0].shared.shape[1], several[0].own.shape[1]
    width = shared + own * len(several)
    blocks, count = [], 0
    for k, one in enumerate(several):
        rows = np.column_stack([one.shared, one.own, one.seen])
        for stretch in np.array_split(rows, stretches):
            small = np.linalg.qr(stretch, 'r')
            block = np.zeros((len(small), width + 1))
            block[:, :shared], block[:, width] = small[:, :shared], small[:, -1]
            block[:, shared + own * k:shared + own * (k + 1)] = small[:, shared:-1]
            blocks.append(block)
        count += len(one.seen)
    stacked = np.vstack(blocks)
    size = np.linalg.norm(stacked[:, :width], axis=0)
    size[size == 0.0] = np.inf
    left, values, right = np.linalg.svd(stacked[:, :width] / size, full_matrices=False)
    told = values > 1e-9 * values[0]
    inverse = np.where(told, 1.0 / np.where(told, values, 1.0), 0.0)
    x = right.T @ (inverse * (left.T @ stacked[:, width])) / size
    rest = stacked[:, width] - stacked[:, :width] @ x
    independent = min(count, SAMPLES * len(several))
    # of a mean square over so many samples, as if all that are alike were one
    variance = float(rest @ rest) / max(independent - width, 1)
    root = right.T * inverse / size[:, None]
    covariance = variance * root @ root.T
    if stretches > 1:
        moved = np.stack([_without(blocks, k, size) - x for k in range(len(blocks))])
        covariance += (1.0 - 1.0 / stretches) * moved.T @ moved
    untold = (np.sum((right.T * ~told)**2, axis=1) > 1e-6) | np.isinf(size)
    covariance[untold] = covariance[:, untold] = np.nan
    return Pooled(x[:shared], x[shared:].reshape(len(several), own), covariance)


def _without(blocks: Sequence[np.ndarray], left_out: int, size: np.ndarray) -> np.ndarray:
    """Return the values without one block; each column is divided by its ``size``."""
    rest = np.vstack([block for k, block in enumerate(blocks) if k != left_out])
    return np.linalg.lstsq(rest[:, :-1] / size, rest[:, -1], rcond=1e-9)[0] / size
