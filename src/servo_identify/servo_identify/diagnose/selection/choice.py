"""A set of hypotheses, and the same fitted to the residuals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


@dataclass(frozen=True)
class Choice:
    """A set of hypotheses with the sign of each: (number, which of its bounds)."""

    members: tuple[tuple[int, int], ...]

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the hypotheses."""
        return tuple(number for number, _ in self.members)

    def plus(self, number: int, side: int) -> Choice:
        """Return the set with one more."""
        return Choice((*self.members, (number, side)))

    def minus(self, number: int) -> Choice:
        """Return the set without one."""
        return Choice(tuple(m for m in self.members if m[0] != number))


@dataclass(frozen=True, eq=False)
class Fitted:
    """
    A set fitted to the residuals.

    ``columns`` of the regression with their ``values`` (that of the residual, first, is 1);
    ``held_out`` (equations, blocks) squared errors of blocks that the fit did not see;
    ``score`` the sum over groups of n/2 log of the held-out mean square above the floor, where n
    counts observations;
    ``weight`` (equations, families) of the groups; ``doubt`` by equation how many samples
    count as one observation; ``numbers`` amplitudes at work, shapes searched and tolerances used
    up; ``cost`` of these, as Schwarz has it; ``far`` that of values far from the file's, in it.
    """

    choice: Choice
    columns: np.ndarray
    values: np.ndarray
    held_out: np.ndarray
    score: float
    weight: np.ndarray
    doubt: np.ndarray
    numbers: float
    cost: float
    far: float

    @property
    def total(self) -> float:
        """What a set leaves and what it costs, nats: the less the better."""
        return self.score + self.cost


class Settled(NamedTuple):
    """
    Values with the residual first, and what they came from.

    ``weighed`` are the weights that they were fitted with, ``gram`` and ``prior`` the sums of that
    fit; ``weight`` and ``doubt`` what is left asks for, above ``floor``.
    """

    values: np.ndarray
    weighed: np.ndarray
    gram: np.ndarray
    prior: np.ndarray
    floor: np.ndarray
    weight: np.ndarray
    doubt: np.ndarray
