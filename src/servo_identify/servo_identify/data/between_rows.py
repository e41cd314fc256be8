r"""
How far a straight line between two rows may be off, by what each row shows between its neighbours.

A row that lies off the line of its neighbours by e has a line off by e / 4 on either side, since
the error of a line goes with the square of its length.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .joining import HELD
from .rows_in_time import HOLE


class BetweenRows:
    """Watches rows of columns as they come, part by part, with their times as ``t``."""

    def __init__(self) -> None:
        self._last: Mapping[str, np.ndarray] = {}
        self._off = dict[str, float]()
        self._low, self._high = dict[str, float](), dict[str, float]()

    def add(self, columns: Mapping[str, np.ndarray]) -> None:
        """Look at the next rows; those of commands, which are held, are not interpolated."""
        joined = {name: np.concatenate([self._last[name], column]) if self._last else column
                  for name, column in columns.items()}
        self._last = {name: column[-2:] for name, column in joined.items()}
        steps = np.diff(joined['t'])
        before, after = steps[:-1], steps[1:]
        near = (before > 0.0) & (after > 0.0) & (
            np.maximum(before, after) <= HOLE * np.minimum(before, after))
        share = before / np.where(near, before + after, 1.0)
        for name, column in joined.items():
            if name in HELD or name == 't':
                continue
            off = np.abs(column[1:-1] - column[:-2] - share * (column[2:] - column[:-2])) / 4.0
            off = off[near & np.isfinite(off)]
            known = column[np.isfinite(column)]
            self._off[name] = float(np.max(off, initial=self._off.get(name, 0.0)))
            self._low[name] = float(np.min(known, initial=self._low.get(name, np.inf)))
            self._high[name] = float(np.max(known, initial=self._high.get(name, -np.inf)))

    def sentence(self) -> str:
        """Say by how much of its range each channel may be off between rows; '' for none."""
        shares = {name: 100.0 * off / (self._high[name] - self._low[name])
                  for name, off in self._off.items() if self._high[name] > self._low[name]}
        if not shares:
            return ''
        told = ', '.join(f'{share:.2g} % of {name}' for name, share in shares.items())
        return f'; between rows a line may be off, in shares of the range, by {told}'
