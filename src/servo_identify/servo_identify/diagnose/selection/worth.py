"""How many numbers a hypothesis is worth: what it costs to have them free."""

from __future__ import annotations

import numpy as np

from ..mechanisms.hypothesis import Hypothesis

AT_WORK = 0.02  # share of the largest contribution from which an amplitude is at work
SHAPE = 2  # numbers that a curve of one sign is worth, however many parts it is mixed of


def worth(one: Hypothesis, values: np.ndarray, squares: np.ndarray) -> int:
    """Return how many numbers a hypothesis has at work; ``squares`` (n,) of their columns."""
    shared = one.signs == 1  # which of these work is a choice too, also where one does alone
    searched = 1 + len(one.detail) if one.tried > 1 else 0
    at_work = int((working(values, squares) & ~shared).sum())
    return at_work + min(int(shared.sum()), SHAPE) + searched


def idle(one: Hypothesis, values: np.ndarray, squares: np.ndarray) -> int:
    """Return how many of its free amplitudes hardly act beside the others."""
    return int((~working(values, squares) & (one.signs == 0)).sum())


def working(values: np.ndarray, squares: np.ndarray) -> np.ndarray:
    """Return which amplitudes do anything beside the others; ``squares`` (n,) of their columns."""
    share = np.abs(values) * np.sqrt(np.maximum(squares, 0.0))
    return share > AT_WORK * share.max(initial=0.0)
