"""Which of two causes leaves less, how surely, and how many numbers each may choose."""

from __future__ import annotations

import numpy as np

from .screening import Screening

SEEN = (1.2, 0.05)  # times and squares of the scale by which one leaves more, so that it is seen
SURELY = 3.5  # standard deviations over blocks by which the better of two laws is told
LITTLE = 0.05  # and the share of what it leaves, or all laws but the exact one were surely worse


def as_good(left: dict[int, float], least: dict[int, float], times: float, more: float) -> bool:
    """Tell whether squares by balance are no more than so many times others and a little."""
    return all(square <= times * least[b] + more for b, square in left.items())


def surely_worse(screening: Screening, one: int, most: int, chosen: list[int]) -> bool:
    """Tell whether a candidate leaves more than another in a balance, little but for sure."""
    stack = screening.stack
    behind = screening.residual([*chosen, one])**2 - screening.residual([*chosen, most])**2
    left = screening.residual([*chosen, most])**2
    for index in np.unique(stack.balance):
        rows = stack.balance == index
        drop = np.bincount(screening.blocks[rows], behind[rows])
        sure = drop.sum() > SURELY * np.sqrt(len(drop)) * np.std(drop)
        if sure and drop.sum() > LITTLE * float(np.sum(left[rows])):
            return True
    return False


def complexity(screening: Screening, one: int) -> int:
    """
    How many numbers a candidate may choose.

    A shape with a grid is one, an order too: it was read off the residual.
    """
    shapes = screening.library.candidates[one].shapes
    return len(screening.members[one]) + sum(
        bool(screening.stack.extended.declaration(path).grid) for path, _ in shapes)
