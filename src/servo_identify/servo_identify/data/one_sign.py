"""A current without its sign: it comes back to zero where the command changes its sign."""

from __future__ import annotations

import numpy as np

NEAR, AWAY = 0.05, 0.2  # share of its largest value within which a current is zero, and is not
CROSSED = 0.02  # share of its range by which a command must be beyond zero: noise


def touches(current: np.ndarray) -> int:
    """Return how often a current (samples,) comes from afar to zero and goes again."""
    size = np.abs(current[np.isfinite(current)])
    most = size.max(initial=0.0)
    return _changes(np.where(size <= NEAR * most, -1, np.where(size >= AWAY * most, 1, 0))) // 2


def crossings(command: np.ndarray) -> int:
    """Return how often a command (samples,) changes its sign."""
    told = command[np.isfinite(command)]
    return _changes(np.where(np.abs(told) > CROSSED * np.ptp(told), np.sign(told), 0)
                    if len(told) else told)


def _changes(states: np.ndarray) -> int:
    """Return how often a state of -1 or 1 becomes the other; 0 is neither."""
    return int(np.sum(np.diff(states[states != 0]) != 0))
