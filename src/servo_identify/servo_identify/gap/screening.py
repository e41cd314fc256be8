"""
A regression of all balances on what may be missing, under blocked cross-validation.

Everything that may move without anything being missing (tolerances, zeros, instants of sampling)
is fitted anew beside every choice, inside its bounds.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import chi2, norm

from .candidates import Candidate
from .library import Library
from .regression import Folds
from .shapes import Shapes
from .stack import Beside, Stack

FOLDS = 8
KEPT = 64  # residuals that are remembered: each is asked for many times over
FAR = 4.0  # times by which a parameter beyond its tolerance may be off


@dataclass
class Screening:
    """A regression of all balances on what may move and what may be missing."""

    stack: Stack
    library: Library
    labels: list[str] = field(init=False)
    low: np.ndarray = field(init=False)
    high: np.ndarray = field(init=False)
    fits: dict = field(init=False, repr=False, default_factory=dict)
    shapes: Shapes = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.labels, nuisances, low, high = self.stack.nuisances()
        starts, at = [], nuisances.shape[1]
        lows, highs = [low], [high]
        for candidate, table in zip(self.library.candidates, self.library.tables, strict=True):
            starts.append(np.arange(at, at + table.shape[1]))
            at += table.shape[1]
            bounds = np.array([self._room(candidate, i) for i in range(table.shape[1])])
            lows.append(bounds[:, 0])
            highs.append(bounds[:, 1])
        self.low, self.high = np.concatenate(lows), np.concatenate(highs)
        self.nuisance = np.arange(nuisances.shape[1])
        self.shapes = Shapes(self.stack, self.library.candidates)
        self.members = starts
        self.weight = np.ones(len(self.stack.base))
        self.folds = Folds(self.stack.base, (nuisances, *self.library.tables), self.stack.block,
                           FOLDS, self.weight)
        self.library.tables.clear()
        self._left: OrderedDict[tuple[int, ...], np.ndarray] = OrderedDict()
        self._known = (), np.zeros((0, 0))
        self.blocks = np.unique(self.stack.block, return_inverse=True)[1]

    def weigh(self, squares: dict[int, float]) -> None:
        """Have each balance count in fits and losses by what it is over a mean square of its."""
        weight = self.weight.copy()
        for index, square in squares.items():
            weight[self.stack.balance == index] = max(1.0, square) ** -0.5
        if np.array_equal(weight, self.weight):
            return  # all products and fits still hold
        self.weight = weight
        self.folds.weigh(self.weight)
        self.fits.clear()
        self._left.clear()

    def weighed(self) -> dict[int, float]:
        """Return the mean squares by which each balance was last weighed."""
        balance = self.stack.balance
        return {int(b): float(self.weight[balance == b][0])**-2 for b in np.unique(balance)}

    def columns(self, used: np.ndarray) -> np.ndarray:
        """Change of all rows for one unit of some nuisances and amplitudes, (rows, numbers)."""
        return self.folds.columns(used)

    def table(self, one: int) -> np.ndarray:
        """Change of all rows for one unit of each amplitude of a candidate."""
        return self.folds.columns(self.members[one])

    def add(self, candidate: Candidate, table: np.ndarray, amplitudes: np.ndarray) -> int:
        """Take in another candidate and return its number."""
        self.members.append(self.folds.grow(table))
        bounds = np.array([self._room(candidate, i) for i in range(table.shape[1])])
        self.low = np.concatenate((self.low, bounds[:, 0]))
        self.high = np.concatenate((self.high, bounds[:, 1]))
        self.library.candidates.append(candidate)
        self.library.amplitudes.append(amplitudes)
        return len(self.members) - 1

    def _beside(self, chosen: list[int], candidate: Candidate, table: np.ndarray):
        """Return (columns used, products, low, high, unknowns) of a fit of some beside others."""
        used = self.used(chosen)
        used = np.array([u for u in used if u >= len(self.nuisance)
                         or self.labels[u].split(':')[0] not in candidate.paths], dtype=int)
        room = np.array([self._room(candidate, i) for i in range(table.shape[1])])
        return used, *self._with_more(used, table, *room.T)

    def _with_more(self, used: np.ndarray, table: np.ndarray, low: np.ndarray, high: np.ndarray):
        key = tuple(used)
        known = self._known  # once: several threads may ask
        if key != known[0]:
            self._known = known = key, self.folds.table(used)
        folds = self.folds.with_more(known[1], used, table)
        return (folds, np.concatenate((self.low[used], low)),
                np.concatenate((self.high[used], high)), np.arange(len(used) + len(low)))

    def loss_beside(self, chosen: list[int], table: np.ndarray) -> float:
        """Return the loss with columns beside the chosen ones that may be of any size."""
        far = np.full(table.shape[1], np.inf)
        folds, low, high, members = self._with_more(self.used(chosen), table, -far, far)
        return folds.loss(members, low, high)

    def loss_with(self, chosen: list[int], candidate: Candidate, table: np.ndarray) -> float:
        """Return the loss with a candidate that is not in the library, by its columns."""
        _, folds, low, high, members = self._beside(chosen, candidate, table)
        return folds.loss(members, low, high)

    def fitted(self, chosen: list[int], candidate: Candidate, table: np.ndarray,
               last: np.ndarray) -> tuple[np.ndarray, Beside | None]:
        """
        Return (fitted amplitudes, what is fitted beside them if that matters to the candidate).

        Amplitudes that came out as nothing stay as they were.
        """
        used, folds, low, high, members = self._beside(chosen, candidate, table)
        fitted = folds.fit(members, low, high)
        size = fitted[len(used):]
        size = np.where(np.abs(size) > 1e-3 * np.abs(last) + 1e-12, size, last)
        if not candidate.bends_mesh:
            return size, None
        return size, self._values_beside(chosen, used, fitted[:len(used)])

    def _values_beside(self, chosen: list[int], used: np.ndarray, fitted: np.ndarray) -> Beside:
        """Return values that any servo file has, tolerances and chosen causes, as fitted."""
        extended, library = self.stack.extended, self.library.candidates
        slots = {n: extended.slot(self.labels[n]) for n in self.nuisance
                 if self.labels[n] in extended.servo.values}
        for c in chosen:
            if library[c].switch is None:
                slots.update(zip(self.members[c], map(
                    extended.slot, library[c].paths, library[c].elements), strict=True))
        own = np.isin(used, list(slots))
        theta = extended.theta.copy()
        for column, value in zip(used[own], fitted[own], strict=True):
            theta[slots[column]] += value
        return Beside(theta, self.stack.base + self.columns(used[own]) @ fitted[own])

    def _room(self, candidate: Candidate, i: int) -> tuple[float, float]:
        path, element = candidate.paths[i], candidate.elements[i]
        value = self.stack.extended.theta[self.stack.extended.slot(path, element)]
        low, high = self.room(candidate, path, element)
        return low - value, high - value

    def room(self, candidate: Candidate, path: str, element: int) -> tuple[float, float]:
        """Return the (low, high) between which a candidate's amplitude may lie."""
        extended = self.stack.extended
        value = extended.theta[extended.slot(path, element)]
        low, high = extended.declaration(path).bounds
        # a data sheet is not off by more; how strong an effect is, friction above all, may be
        if candidate.switch is None and value != 0.0 and not path.startswith('effects.'):
            ends = sorted((value / FAR, value * FAR))
            low, high = max(low, ends[0]), min(high, ends[1])
        return low, high

    def used(self, chosen: Iterable[int]) -> np.ndarray:
        """Columns of the nuisances and of some candidates; a freed parameter counts once."""
        chosen = list(chosen)
        freed = {path for c in chosen for path in self.library.candidates[c].paths}
        kept = [n for n in self.nuisance if self.labels[n].split(':')[0] not in freed]
        return np.concatenate([np.array(kept, dtype=int)]
                              + [self.members[c] for c in chosen]).astype(int)

    def loss(self, chosen: Iterable[int]) -> float:
        """Return the cross-validated sum of squares with some candidates in."""
        used = self.used(chosen)
        return self.folds.loss(used, self.low[used], self.high[used])

    def least(self, chosen: Iterable[int]) -> float:
        """Return what is quickly known of a loss: that it is no smaller."""
        used = self.used(chosen)
        return self.folds.least(used, self.low[used], self.high[used])

    def coefficients(self, chosen: Iterable[int]) -> tuple[np.ndarray, np.ndarray]:
        """Return (columns used, their values) fitted to all rows."""
        used = self.used(chosen)
        return used, self.folds.fit(used, self.low[used], self.high[used])

    def strain(self, chosen: list[int]) -> float:
        """
        Return how far values within tolerance have to move with some candidates in.

        The sum of the squares of their shares of their tolerances: 1 for one at its bound.
        """
        servo, total = self.stack.extended.servo, 0.0
        for column, change in zip(*self.coefficients(chosen), strict=True):
            path = self.labels[column].split(':')[0] if column < len(self.nuisance) else ''
            if path not in servo.tolerance:
                continue
            low, high = servo.tolerance[path]
            value = self.stack.extended.theta[self.stack.extended.slot(path)] + change
            given = servo.values[path]
            room = high - given if value > given else given - low
            total += ((value - given) / room) ** 2 if room > 0.0 else 0.0
        return float(total)

    def residual(self, chosen: Iterable[int], held_out: bool = True) -> np.ndarray:
        """Return what is left, each row predicted from the other folds unless told otherwise."""
        used = self.used(chosen)
        low, high = self.low[used], self.high[used]
        if not held_out:
            return self.stack.base + self.columns(used) @ self.folds.fit(used, low, high)
        key = tuple(used)
        if key not in self._left:
            self._left[key] = self.folds.left(used, low, high)
            self._left[key].flags.writeable = False
            while len(self._left) > KEPT:
                self._left.popitem(last=False)
        self._left.move_to_end(key)
        return self._left[key]

    def squares(self, chosen: list[int]) -> dict[int, float]:
        """Mean square of what is left, by balance."""
        left, balance = self.residual(chosen), self.stack.balance
        return {int(b): float(np.mean(left[balance == b]**2)) for b in np.unique(balance)}

    def significance(self, one: int, chosen: list[int]) -> float:
        """
        Return how far a candidate is from nothing, in standard deviations.

        The largest of three tests over blocks, which know nothing of how samples within a block
        hang together: Wald's of the amplitudes, which does not punish an effect that shows in a
        few blocks, that of the held-out gain, which holds where much else is still unexplained,
        and that of the share of each block, which holds where few blocks have most of the gap.
        """
        return max(self._drop(one, chosen), self._drop_of_shares(one, chosen),
                   self._wald(one, chosen))

    def is_sure(self, one: int, chosen: list[int], limit: float) -> bool:
        """Tell whether the :meth:`significance` of a candidate reaches a limit."""
        return any(test(one, chosen) >= limit for test in (
            self._drop, self._drop_of_shares, self._wald))

    def _drop(self, one: int, chosen: list[int]) -> float:
        before, after = self.residual(chosen), self.residual([*chosen, one])
        return self.sureness(before**2 - after**2)

    def _drop_of_shares(self, one: int, chosen: list[int]) -> float:
        sizes = np.bincount(self.blocks)
        before, after = (np.log1p(np.bincount(self.blocks, self.residual(causes)**2) / sizes)
                         for causes in (chosen, [*chosen, one]))
        return _sureness(before - after)

    def sureness(self, drop: np.ndarray) -> float:
        """Return a sum of what rows lose in standard deviations, over blocks."""
        return _sureness(np.bincount(self.blocks, drop))

    def _wald(self, one: int, chosen: list[int]) -> float:
        """Return Wald's test of a candidate's amplitudes, as standard deviations."""
        used, fitted = self.coefficients([*chosen, one])
        table = self.columns(used) * self.weight[:, None]
        left = self.stack.base * self.weight + table @ fitted
        weight = np.sqrt((table**2).sum(axis=0)) + 1e-300
        table = table / weight
        scores = np.zeros((self.blocks.max() + 1, len(used)))
        np.add.at(scores, self.blocks, table * left[:, None])
        inside = (fitted > self.low[used]) & (fitted < self.high[used])
        mine = np.isin(used, self.members[one])
        inside |= mine
        gram = table[:, inside].T @ table[:, inside] + 1e-9 * np.eye(int(inside.sum()))
        bread = np.linalg.inv(gram)
        blocks = len(scores)
        meat = scores[:, inside].T @ scores[:, inside] * blocks / max(blocks - inside.sum(), 1)
        spread = bread @ meat @ bread
        mine = mine[inside]
        size = (fitted * weight)[inside][mine]
        wald = float(size @ np.linalg.pinv(spread[np.ix_(mine, mine)]) @ size)
        return float(norm.isf(max(chi2.sf(wald, mine.sum()), 1e-300)))


def _sureness(drops: np.ndarray) -> float:
    """Return the sum of what blocks lose in standard deviations."""
    return float(drops.sum() / (np.std(drops) * np.sqrt(len(drops)) + 1e-12))
