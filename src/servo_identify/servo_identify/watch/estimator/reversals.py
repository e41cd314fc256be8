"""The backlash of a transmission, measured at each reversal of the torque that it carries."""

from __future__ import annotations

from collections import deque
from math import isfinite

import numpy as np

_SETTLED = 0.05  # s on a flank before its torsion is taken
_NEAR = 0.02  # rad of the load between both flanks, or the transmission error spoils it


class Reversals:
    """
    Finds changes of the flank in a stream of torsion and torque.

    ``least`` N m makes a flank. The torsion of a flank is the mean over the last, or the first,
    0.05 s on it; a change whose flanks lie too far apart gives nothing.
    """

    def __init__(self, period: float, least: float) -> None:
        self._size = max(3, round(_SETTLED / period))
        self._least = least
        self._flank = 0
        self._on: deque[tuple[float, float]] = deque(maxlen=self._size)
        self._left: tuple[int, float, float] | None = None
        self._told = False

    def forget(self) -> None:
        """Begin again, as after samples that were lost."""
        self._flank, self._left, self._told = 0, None, False
        self._on.clear()

    def take(self, wind_up: np.ndarray, torque: np.ndarray, load: np.ndarray) -> list[float]:
        """Return the plays, rad, that a block of samples shows; arrays of shape (n,)."""
        found = []
        flanks = np.where(np.abs(torque) >= self._least, np.sign(torque), 0.0)
        for flank, slip, angle in zip(flanks.tolist(), wind_up.tolist(), load.tolist(),
                                      strict=True):
            if not (isfinite(slip) and isfinite(angle)):
                self.forget()
            elif flank and flank != self._flank:
                if len(self._on) == self._size:
                    self._left = (self._flank, *np.mean(self._on, axis=0))
                self._flank, self._told = flank, False
                self._on.clear()
                self._on.append((slip, angle))
            elif flank:
                self._on.append((slip, angle))
                if len(self._on) == self._size and not self._told:
                    self._told = True
                    found += self._play()
        return found

    def _play(self) -> list[float]:
        """Return what lies between the flank that was left and this one, if it can be said."""
        left, self._left = self._left, None
        if left is None or left[0] != -self._flank:
            return []
        slip, angle = np.mean(self._on, axis=0)
        return [self._flank * (slip - left[1])] if abs(angle - left[2]) < _NEAR else []
