"""
A set of mechanisms fitted to the residuals, and judged by blocks that it was not fitted to.

Errors of each equation in each family of excitation count by their logarithm, so that a large gap
in one place drowns none in another. They count down to a floor: noise, the practical margin, and
how far the form of an accepted mechanism may be off. Samples count as observations as far as they
are independent without any mechanism, in all sets alike.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from ...fit.free_values import SURE
from ..decisions import CALIBRATED, FORM
from ..mechanisms.values import far_off
from .bounded_least_squares import every_least
from .choice import Choice, Fitted, Settled
from .regression import FOLDS, Products, Regression, solve, Sums
from .worth import idle, worth

MISLEADS = 10.0  # times the weight of one family over another that may mislead a fit
KEPT = 4  # weights whose sums of products are kept


class Fits:
    """
    Fits sets of hypotheses and scores what they leave.

    ``floor`` (equations, families) is the mean square of each group below which nothing is
    chased; without it, it is that of :meth:`floor` for what is left without any mechanism.
    """

    turns = 2  # in which each group is weighed by what is left of it

    def __init__(self, regression: Regression, floor: np.ndarray | None = None) -> None:
        self.regression = regression
        self._given = floor
        self._known: dict[Choice, Fitted] = {}
        self._sums: dict[bytes, Sums] = {}
        self._bounds = [one.bounds() for one in regression.hypotheses]
        one = np.zeros((regression.blocks, len(regression.families)))
        one[np.arange(regression.blocks), regression.family] = 1.0
        self._family = one
        self.sizes = regression.counts @ one
        self._blocks_of = (regression.counts > 0) @ one

    @property
    def choices(self) -> list[Choice]:
        """All sets that were fitted."""
        return list(self._known)

    @property
    def tried(self) -> set[int]:
        """The numbers of the hypotheses of all sets that were fitted."""
        return {number for choice in self._known for number in choice.numbers}

    def groups(self, errors: np.ndarray) -> np.ndarray:
        """Return mean squares by equation and family from errors by equation and block."""
        with np.errstate(invalid='ignore', divide='ignore'):
            return np.where(self.sizes > 0, (errors @ self._family) / self.sizes, 0.0)

    @property
    def price(self) -> float:
        """What one number costs, nats."""
        return 0.5 * float(np.log(max(2, self.regression.blocks)))

    @cached_property
    def observations(self) -> np.ndarray:
        """How much of an observation a sample of each equation is, (equations,)."""
        return 1.0 / self.nothing.doubt

    def score(self, errors: np.ndarray, floor: np.ndarray, each: np.ndarray) -> float:
        """Return what is left above a floor: the sum over groups of n/2 log of mean squares."""
        left = np.maximum(self.groups(errors), floor)
        return float(0.5 * (each[:, None] * self.sizes * np.log(np.maximum(left, 1e-12))).sum())

    @cached_property
    def nothing(self) -> Fitted:
        """The servo within its tolerances, without any mechanism."""
        return self.fitted(Choice(()))

    def bounds_of(self, choice: Choice, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the bounds of the nuisances and the amplitudes of a set."""
        low, high = [self.regression.low[kept]], [self.regression.high[kept]]
        for number, side in choice.members:
            one = self._bounds[number][side]
            low.append(one[0])
            high.append(one[1])
        return np.concatenate(low), np.concatenate(high)

    def columns_of(self, choice: Choice) -> tuple[np.ndarray, np.ndarray]:
        """Return (all columns with the residual first, nuisances among them)."""
        kept = self.regression.nuisances(choice.numbers)
        return np.concatenate([[0], kept, *(self.regression.members[n]
                                            for n in choice.numbers)]).astype(int), kept

    def fitted(self, choice: Choice) -> Fitted:
        """Return a set fitted, with its held-out errors."""
        if choice not in self._known:
            self._known[choice] = self._fitted(choice)
        return self._known[choice]

    def _fitted(self, choice: Choice) -> Fitted:
        regression = self.regression
        columns, kept = self.columns_of(choice)
        low, high = self.bounds_of(choice, kept)
        room = self.room(kept, len(columns) - 1)
        products = regression.of(columns)
        several = [self._settled(choice, products, weight, doubt, (low, high), room)
                   for weight, doubt in self._starts(choice)]
        best = several[0] if len(several) == 1 else min(several, key=lambda one: self.score(
            products.errors(one.values), one.floor, self.observations))
        values, total, floor = best.values, best.gram, best.floor
        near = values[1:] if choice.members else np.zeros(len(values) - 1)
        there = np.ones((FOLDS, len(values)))
        there[:, 1:] = every_least(total - products.folds(best.weighed), best.prior, low, high,
                                   near, bool(choice.members))
        held_out = products.errors(there[regression.fold])
        used = (values[1:] / room) ** 2
        cost = 0.5 * SURE**2 * float(used.sum())
        count, far, at = float(used.sum()), 0.0, len(kept)
        for number in choice.numbers:
            one = regression.hypotheses[number]
            mine = slice(at, at + one.columns.size)
            at = mine.stop
            more = worth(one, values[1:][mine], np.diag(total)[1:][mine])
            count += more
            cost += self.price * more
            far += far_off(regression.samples, one, values[1:][mine])
        each = self.observations if choice.members else 1.0 / best.doubt
        return Fitted(choice, columns, values, held_out, self.score(held_out, floor, each),
                      best.weight, best.doubt, count, float(cost + far), far)

    def _settled(self, choice: Choice, products: Products, weight: np.ndarray, doubt: np.ndarray,
                 bounds: tuple[np.ndarray, np.ndarray], room: np.ndarray) -> Settled:
        """Return the values of a set, weighed by what they leave."""
        unknowns = np.arange(len(room) + 1)
        for turn in range(self.turns):
            sums = products.sums(weight)
            total, doubts = sums.whole, self.doubts(doubt, sums, unknowns)
            prior = SURE**2 * doubts / room**2
            values = np.concatenate(([1.0], solve(total, *bounds, prior)))
            left = self.groups(products.errors(values))
            floor = self.floor(left if not choice.members else None)
            last = weight
            if turn + 1 < self.turns:
                weight = self._quantised(1.0 / np.maximum(floor, left))
                doubt = self._doubt(left, floor)
        return Settled(values, last, total, prior, floor, weight, doubt)

    def _starts(self, choice: Choice) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """
        Yield the weights and doubts from which a fit may begin.

        Those of the set without its last member are one. Where they set families of an equation
        far apart, one that already fits would hold the new member from what it does in the
        others: then all families alike are another.
        """
        if not choice.members:
            yield np.ones(self.sizes.shape), np.ones(len(self.sizes))
            return
        near = self.fitted(Choice(choice.members[:-1]))
        yield near.weight, near.doubt
        there = self.sizes > 0
        low = np.where(there, near.weight, np.inf).min(axis=1, keepdims=True)
        if np.any(there & (near.weight > MISLEADS * low)):
            yield np.where(there, low, near.weight), near.doubt

    def idle(self, fit: Fitted) -> int:
        """Return how many free amplitudes of a set hardly act beside the others of their law."""
        squares, count = np.diag(self.sums(fit.weight).whole), 0
        for number in fit.choice.numbers:
            mine = np.isin(fit.columns, self.regression.members[number])
            count += idle(self.regression.hypotheses[number], fit.values[mine],
                          squares[fit.columns[mine]])
        return count

    @staticmethod
    def doubts(doubt: np.ndarray, sums: Sums, columns: np.ndarray) -> np.ndarray:
        """Return for each unknown how many samples count as one, by the equations it shows in."""
        share = sums.power[:, columns[1:]]
        return doubt @ share / np.maximum(share.sum(axis=0), 1e-300)

    def room(self, kept: np.ndarray, size: int) -> np.ndarray:
        """Return the tolerance of each unknown, infinite where the servo file gives none."""
        room = np.full(size, np.inf)
        room[:len(kept)] = self.regression.room[kept]
        return room

    def _doubt(self, left: np.ndarray, floor: np.ndarray) -> np.ndarray:
        """
        Return by equation how many samples count as one observation.

        Noise is independent from sample to sample. What no model explains yet is not: there a
        whole block is one observation, and thousands of its samples must not outvote a data sheet.
        """
        above = left > floor
        whole = np.maximum((self.sizes * above).sum(axis=1), 1.0)
        blocks = np.maximum((self._blocks_of * above).sum(axis=1), 1.0)
        share = (self.sizes * np.maximum(0.0, 1.0 - floor / np.maximum(left, 1e-12))).sum(axis=1)
        return 1.0 + share / whole * np.where(above.any(axis=1), whole / blocks, 0.0)

    def sums(self, weight: np.ndarray) -> Sums:
        """Return the sums of products under a weight; the last few are kept."""
        key = weight.tobytes()
        if key not in self._sums:
            while len(self._sums) >= KEPT:
                self._sums.pop(next(iter(self._sums)))
            self._sums[key] = self.regression.sums(weight)
        return self._sums[key]

    def _quantised(self, weight: np.ndarray) -> np.ndarray:
        """Round weights to steps of a fifth, so that like sets share their sums of products."""
        return np.exp(np.round(np.log(np.maximum(weight, 1e-12)) / 0.2) * 0.2)

    def floor(self, gap: np.ndarray | None = None) -> np.ndarray:
        """
        Return the mean square of each group below which nothing is chased.

        It is that of noise and the practical margin, and how far the best form may be off the gap
        of its equation.
        """
        if gap is None:
            return self._floor
        size = self.sizes.sum(axis=1, keepdims=True)
        whole = (gap * self.sizes).sum(axis=1, keepdims=True) / np.maximum(size, 1.0)
        return np.broadcast_to(CALIBRATED + FORM**2 * np.maximum(0.0, whole - 1.0),
                               self.sizes.shape)

    @cached_property
    def _floor(self) -> np.ndarray:
        if self._given is not None:
            return self._given
        return self.floor(self.groups(self.nothing.held_out))
