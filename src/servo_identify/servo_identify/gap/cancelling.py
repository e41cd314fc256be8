"""
Causes that undo each other.

Where the law that acts is not in the catalogue, two others may take its place together: both large
and of opposite sign, so that only what differs between them is seen. Two things that a machine
truly lacks have no reason to cancel.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from .balance import BALANCES
from .screening import Screening

OPPOSITE = -0.8  # cosine of what two causes do to a balance
ALIKE = 0.5  # share of the larger that the smaller one reaches
MATTERS = 1.0  # root mean square of the smaller, in units of the scale


def without_cancelling(screening: Screening, chosen: list[int]) -> tuple[list[int], list[str]]:
    """Return (causes of which no two undo each other, what is to be said of those that do)."""
    pairs = cancelling(screening, chosen)
    undone = {cause for one, other, _ in pairs for cause in (one, other)}
    label = {cause: screening.library.candidates[cause].label for cause in undone}
    return [cause for cause in chosen if cause not in undone], [
        f'{label[one]} and {label[other]} undo each other in the balance of the {balance} and are '
        'not taken' for one, other, balance in pairs]


def cancelling(screening: Screening, chosen: list[int]) -> list[tuple[int, int, str]]:
    """Return (one, other, balance) of causes that undo each other in a balance."""
    done = _done(screening, chosen)
    found = []
    for one, other in combinations(chosen, 2):
        for index in np.unique(screening.stack.balance):
            rows = screening.stack.balance == index
            x, y = done[one][rows], done[other][rows]
            small, large = sorted((np.linalg.norm(x), np.linalg.norm(y)))
            if (small > MATTERS * np.sqrt(len(x)) and small >= ALIKE * large
                    and x @ y < OPPOSITE * small * large):
                found.append((one, other, BALANCES[index]))
    return found


def _done(screening: Screening, chosen: list[int]) -> dict[int, np.ndarray]:
    """Return what each cause does to the rows, fitted beside the others, in units of the scale."""
    used, fitted = screening.coefficients(chosen)
    values = dict(zip(used.tolist(), fitted, strict=True))
    return {one: screening.table(one) @ np.array([values[u] for u in screening.members[one]])
            for one in chosen}
