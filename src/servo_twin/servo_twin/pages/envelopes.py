"""Curves of any length as a page can draw them: the extremes of each of many buckets."""

from __future__ import annotations

import numpy as np

BUCKETS = 1 << 15  # many for each pixel; a recording of less samples is kept as it is


class Envelopes:
    """
    Curves over ``total`` samples, each as the extremes of at most :data:`BUCKETS` buckets.

    Values come in any order of parts; what never came is NaN.
    """

    def __init__(self, total: int) -> None:
        self._size = max(1, -(-total // BUCKETS))  # samples in a bucket
        self._count = -(-total // self._size)
        self._curves: dict[str, tuple[np.ndarray, np.ndarray]] = {}

    def add(self, name: str, first: int, values: np.ndarray) -> None:
        """Take in values of a curve, shape (n,), from sample number ``first`` on."""
        if not len(values):
            return
        if name not in self._curves:
            self._curves[name] = (np.full(self._count, np.nan), np.full(self._count, np.nan))
        begin = first // self._size
        edges = np.maximum(0, np.arange(begin, (first + len(values) - 1) // self._size + 1)
                           * self._size - first)
        for extreme, kept in zip((np.fmin, np.fmax), self._curves[name], strict=True):
            among = kept[begin:begin + len(edges)]
            extreme(among, extreme.reduceat(values, edges), out=among)

    def times(self, period: float) -> np.ndarray:
        """Return the instants, s, at which :meth:`curve` has its values."""
        begins = np.arange(self._count) * self._size * period
        return begins if self._size == 1 else np.column_stack(
            (begins, begins + 0.5 * self._size * period)).ravel()

    def curve(self, name: str) -> np.ndarray:
        """Return a curve: every value, or the lowest and the highest of each bucket in turn."""
        low, high = self._curves[name]
        return low if self._size == 1 else np.column_stack((low, high)).ravel()
