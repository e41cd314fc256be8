"""
Which causes the recordings ask for: forward selection under blocked cross-validation.

Everything that may move without anything being missing (tolerances, zeros, instants of sampling)
is fitted anew beside every choice, inside its bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import chi2, norm

from .balance import BALANCES
from .candidates import Candidate
from .library import Library
from .regression import Folds
from .scales import Scales
from .stack import Stack

FOLDS = 8
CHANCE = 0.01  # that any of all candidates gets in by luck, per step
WORTH = 0.05  # share of a balance's remaining square that a cause must take away
FAINT = 0.12  # and in squares of the scale, so that nothing is chased that does not matter
LATER = 0.015  # share of a balance's first square that a later cause must take away
STILL = 1.3  # square of a balance below which there is nothing left for a later cause
MOST = 6  # causes in one diagnosis
MAINLY = 0.3  # share of the most that a cause takes away in one balance, for another to count
BEYOND = 0.3  # share of the travel by which a place may lie outside it
LARGER = 2.0  # times the largest shape tried first, up to which it is searched
FAR = 4.0  # times by which a parameter beyond its tolerance may be off
CLOSE = 0.7  # share of the best gain from which a candidate is refined before it is judged
REFINED = 5  # and how many of them
OPENS = 2.0  # times by which a cause may not raise the square of a balance, noise at least
SAME = 0.985  # share of the best gain that counts as no worse: then the simpler one
ALIKE = 0.9  # share of a cause's gain that another must reach to be called ambiguous with it


@dataclass(frozen=True)
class Choice:
    """A cause that the screening took, with what else would have done."""

    candidate: Candidate
    gain: float  # cross-validated drop of the sum of squares
    significance: float  # standard deviations of the drop over blocks
    balances: tuple[str, ...] = ()  # those in which it takes most away
    ambiguous: tuple[Candidate, ...] = ()


@dataclass
class Screening:
    """A regression of all balances on what may move and what may be missing."""

    stack: Stack
    library: Library
    labels: list[str] = field(init=False)
    low: np.ndarray = field(init=False)
    high: np.ndarray = field(init=False)
    fits: dict = field(init=False, repr=False, default_factory=dict)
    tried: dict[str, set[float]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.labels, nuisances, low, high = self.stack.nuisances()
        tables, starts, at = [nuisances], [], nuisances.shape[1]
        lows, highs = [low], [high]
        for candidate, table in zip(self.library.candidates, self.library.tables, strict=True):
            starts.append(np.arange(at, at + table.shape[1]))
            at += table.shape[1]
            tables.append(table)
            bounds = np.array([self._room(candidate, i) for i in range(table.shape[1])])
            lows.append(bounds[:, 0])
            highs.append(bounds[:, 1])
        self.columns = np.column_stack(tables)
        self.low, self.high = np.concatenate(lows), np.concatenate(highs)
        self.nuisance = np.arange(nuisances.shape[1])
        self.tried = {}
        for candidate in self.library.candidates:
            for path, value in candidate.shapes:
                self.tried.setdefault(path, set()).add(value)
        self.members = starts
        self.folds = Folds(self.stack.base, self.columns, self.stack.block, FOLDS)
        self._known = (), np.zeros((0, 0))
        self.blocks = np.unique(self.stack.block, return_inverse=True)[1]

    def add(self, candidate: Candidate, table: np.ndarray, amplitudes: np.ndarray) -> int:
        """Take in another candidate and return its number."""
        known = np.column_stack((self.stack.base, self.columns))
        self.folds.grow(known, table)
        at = self.columns.shape[1]
        self.columns = np.column_stack((self.columns, table))
        self.members.append(np.arange(at, at + table.shape[1]))
        bounds = np.array([self._room(candidate, i) for i in range(table.shape[1])])
        self.low = np.concatenate((self.low, bounds[:, 0]))
        self.high = np.concatenate((self.high, bounds[:, 1]))
        self.library.candidates.append(candidate)
        self.library.tables.append(table)
        self.library.amplitudes.append(amplitudes)
        return len(self.members) - 1

    def refined(self, one: int, chosen: list[int], closely: bool = False) -> int:
        """
        Return the number of a version of a candidate at the size and shape that fit best.

        Its columns are taken anew at the fitted amplitudes, so that a law with kinks counts at the
        size it has; each shape is searched on a line, to a few percent when ``closely``.
        """
        version, table = self.library.candidates[one], self.library.tables[one]
        size, least = self._size(one, chosen), self.loss([*chosen, one])
        start = least
        for _ in range(3 if closely else 1):
            before = least
            trial = self.stack.columns(version, size)
            loss = self._loss_with(chosen, version, trial)
            if loss < least:
                least, table = loss, trial
            for i, (path, value) in enumerate(version.shapes):
                if not self._searched(path):
                    continue
                line = _Line(self, chosen, version, i, size, not self.is_place(path))
                around = self.around(path, value)
                found = minimize_scalar(line.loss, bounds=around, method='bounded',
                                        options={'maxiter': 14 if closely else 6,
                                                 'xatol': 0.01 * (around[1] - around[0])})
                if found.fun < least:
                    least = line.loss(found.x)
                    version, table = line.version, line.table
            if least >= before * (1.0 - 1e-4):
                break
            size = self._fitted(chosen, version, table, size)
        if least >= start:
            return one
        return self.add(version, table, size)

    def is_place(self, path: str) -> bool:
        """Tell whether a shape says where and not how much: then it may be negative."""
        return self.stack.extended.declaration(path).bounds[0] < 0.0

    def around(self, path: str, value: float) -> tuple[float, float]:
        """Bounds of the line on which a shape is searched: of its logarithm, unless a place."""
        if self.is_place(path):
            low, high = Scales(self.stack.balances).travelled()
            beyond = BEYOND * (high - low)
            return low - beyond, high + beyond
        low, high = self.within(path)
        middle = float(np.clip(np.log(value), np.log(low), np.log(high)))
        return max(middle - 1.2, np.log(low)), min(middle + 1.2, np.log(high))

    def within(self, path: str) -> tuple[float, float]:
        """Bounds of a shape: not far beyond what the recordings reach, where it would not show."""
        low, high = self.stack.extended.declaration(path).bounds
        tried = self.tried.get(path, ())
        if tried:
            high = min(high, LARGER * max(tried))
        return max(low, 1e-12), high

    def _searched(self, path: str) -> bool:
        parameter = self.stack.extended.declaration(path)
        return bool(parameter.grid) and parameter.name != 'order'

    def _size(self, one: int, chosen: list[int]) -> np.ndarray:
        return self._fitted(chosen, self.library.candidates[one], self.library.tables[one],
                            self.library.amplitudes[one])

    def _beside(self, chosen: list[int], candidate: Candidate, table: np.ndarray):
        """Return (products, low, high, unknowns) of a fit of some columns beside others."""
        used = self.used(chosen)
        used = np.array([u for u in used if u >= len(self.nuisance)
                         or self.labels[u].split(':')[0] not in candidate.paths], dtype=int)
        room = np.array([self._room(candidate, i) for i in range(table.shape[1])])
        key = tuple(used)
        if key != self._known[0]:
            self._known = key, np.column_stack((self.stack.base, self.columns[:, used]))
        folds = self.folds.with_more(self._known[1], used, table)
        return (folds, np.concatenate((self.low[used], room[:, 0])),
                np.concatenate((self.high[used], room[:, 1])), np.arange(len(used) + len(room)))

    def _loss_with(self, chosen: list[int], candidate: Candidate, table: np.ndarray) -> float:
        folds, low, high, members = self._beside(chosen, candidate, table)
        return folds.loss(members, low, high)

    def _fitted(self, chosen: list[int], candidate: Candidate, table: np.ndarray,
                last: np.ndarray) -> np.ndarray:
        """Return the fitted amplitudes; those that came out as nothing stay as they were."""
        folds, low, high, members = self._beside(chosen, candidate, table)
        size = folds.fit(members, low, high)[-table.shape[1]:]
        return np.where(np.abs(size) > 1e-3 * np.abs(last) + 1e-12, size, last)

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
        if candidate.switch is None and value != 0.0:  # a data sheet is not off by more
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

    def coefficients(self, chosen: Iterable[int]) -> tuple[np.ndarray, np.ndarray]:
        """Return (columns used, their values) fitted to all rows."""
        used = self.used(chosen)
        return used, self.folds.fit(used, self.low[used], self.high[used])

    def residual(self, chosen: Iterable[int], held_out: bool = True) -> np.ndarray:
        """Return what is left, each row predicted from the other folds unless told otherwise."""
        used = self.used(chosen)
        low, high = self.low[used], self.high[used]
        left = self.stack.base.astype(float).copy()
        if not held_out:
            return left + self.columns[:, used] @ self.folds.fit(used, low, high)
        for k in range(FOLDS):
            rows = self.folds.fold == k
            left[rows] += self.columns[np.ix_(rows, used)] @ self.folds.fit(used, low, high, k)
        return left

    def worth(self, before: np.ndarray, after: np.ndarray) -> float:
        """
        Return the largest share that any balance loses of its remaining square.

        Drops too faint to matter count as nothing.
        """
        drop, most = before**2 - after**2, 0.0
        for index in np.unique(self.stack.balance):
            rows = self.stack.balance == index
            taken = float(np.mean(drop[rows]))
            if taken > FAINT and float(np.mean(before[rows] ** 2)) > 1.0:
                most = max(most, taken / float(np.mean(before[rows] ** 2)))
        return most

    def significance(self, one: int, chosen: list[int]) -> float:
        """
        Return how far a candidate is from nothing, in standard deviations.

        The larger of two tests over blocks, which know nothing of how samples within a block hang
        together: Wald's of the amplitudes, which does not punish an effect that shows in a few
        blocks, and that of the held-out gain, which holds where much else is still unexplained.
        """
        before, after = self.residual(chosen), self.residual([*chosen, one])
        drop = np.bincount(self.blocks, before**2 - after**2)
        paired = float(drop.sum() / (np.std(drop) * np.sqrt(len(drop)) + 1e-12))
        return max(paired, self._wald(one, chosen))

    def _wald(self, one: int, chosen: list[int]) -> float:
        """Return Wald's test of a candidate's amplitudes, as standard deviations."""
        used, fitted = self.coefficients([*chosen, one])
        table = self.columns[:, used]
        left = self.stack.base + table @ fitted
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

    def select(self, tick: Callable[[float], None]) -> list[int]:
        """Choose causes one by one until nothing more is worth it, pruning and swapping."""
        chosen: list[int] = []
        causes = len({c.key for c in self.library.candidates})
        limit = norm.isf(CHANCE / max(1, causes))
        start = current = self.residual(chosen)
        for step in range(MOST):
            best = self._best(chosen)
            if best is None:
                break
            after = self.residual([*chosen, best])
            if self.significance(best, chosen) < limit or self.worth(current, after) < WORTH:
                break
            if self._share(start, current, after) < LATER:
                break
            chosen.append(best)
            chosen = self._tidied(chosen, limit)
            current = self.residual(chosen)
            tick((step + 1) / MOST)
        return chosen

    def _share(self, start: np.ndarray, before: np.ndarray, after: np.ndarray) -> float:
        """
        Largest share of a balance's first gap that a step takes away.

        A later cause needs a gap that still shows; the first may be as faint as the noise allows.
        """
        shares = []
        for index in np.unique(self.stack.balance):
            rows = self.stack.balance == index
            gap = float(np.sum(start[rows] ** 2))
            if float(np.mean(before[rows] ** 2)) <= (1.0 if before is start else STILL):
                continue
            shares.append(float(np.sum(before[rows] ** 2 - after[rows] ** 2)) / max(gap, 1e-12))
        return max(shares, default=0.0)

    def _best(self, chosen: list[int]) -> int | None:
        taken = {self.library.candidates[c].key for c in chosen}
        start, by_key = self.loss(chosen), {}
        for c, candidate in enumerate(self.library.candidates):
            if candidate.key not in taken:
                gain = start - self.loss([*chosen, c])
                if gain > by_key.get(candidate.key, (0.0, 0))[0]:
                    by_key[candidate.key] = (gain, c)
        close = self._foremost(sorted(by_key.values(), reverse=True), self._squares(chosen),
                               chosen)
        if not close:
            return None
        gains = {}
        for c in close:
            better = self.refined(c, chosen)
            gains[better] = start - self.loss([*chosen, better])
        # among what leaves as little in every balance, the simplest
        most = max(gains, key=gains.get)
        least = self._squares([*chosen, most])
        left = {c: self._squares([*chosen, c]) for c in gains}
        near = [c for c in gains if self._as_good(left[c], least, 1.2, 0.15)
                or (gains[c] >= SAME * gains[most] and self._as_good(left[c], least, 1.6, 0.5))]
        best = min(near, key=lambda c: (self._complexity(c), -gains[c]))
        return self.refined(best, chosen, closely=True)

    def _foremost(self, ranked: list[tuple[float, int]], before: dict[int, float],
                  chosen: list[int]) -> list[int]:
        """
        Return the candidates that gain about as much as the best of them.

        One that opens a gap where there was none is no cause, though another might close it.
        """
        close: list[int] = []
        most = 0.0
        for gain, c in ranked:
            if len(close) == REFINED or gain < CLOSE * most:
                break
            after = self._squares([*chosen, c])
            if all(after[b] <= OPENS * max(1.0, square) for b, square in before.items()):
                most = max(most, gain)
                close.append(c)
        return close

    def _tidied(self, chosen: list[int], limit: float) -> list[int]:
        """Drop what later choices made needless; swap what another now does better."""
        for one in list(chosen):
            rest = [c for c in chosen if c != one]
            if not rest or one not in chosen:
                continue
            alone = self._again(rest)
            before, after = self.residual(alone), self.residual([*alone, one])
            if self.significance(one, alone) < limit or self.worth(before, after) < WORTH:
                chosen = alone
                continue
            before, after = self.residual(rest), self.residual(chosen)
            if self.significance(one, rest) < limit or self.worth(before, after) < WORTH:
                chosen = rest
                continue
            better = self._best(rest)
            if better is not None and better != one:
                gain = self.loss(rest) - self.loss(chosen)
                other = self.loss(rest) - self.loss([*rest, better])
                if other > 1.02 * gain:
                    chosen = [*rest, better]
        return chosen

    def _again(self, chosen: list[int]) -> list[int]:
        """Return the same causes at the sizes and shapes that fit best without any other."""
        for one in chosen:
            rest = [c for c in chosen if c != one]
            chosen = [*rest, self.refined(one, rest, closely=True)]
        return chosen

    def _complexity(self, one: int) -> int:
        """
        How many numbers a candidate may choose.

        A shape with a grid is one, an order too: it was read off the residual.
        """
        shapes = self.library.candidates[one].shapes
        return len(self.members[one]) + sum(
            bool(self.stack.extended.declaration(path).grid) for path, _ in shapes)

    @staticmethod
    def _as_good(left: dict[int, float], least: dict[int, float], times: float,
                 more: float) -> bool:
        return all(square <= times * least[b] + more for b, square in left.items())

    def _squares(self, chosen: list[int]) -> dict[int, float]:
        """Mean square of what is left, by balance."""
        left, balance = self.residual(chosen), self.stack.balance
        return {int(b): float(np.mean(left[balance == b]**2)) for b in np.unique(balance)}

    def _taken(self, rest: list[int], chosen: list[int]) -> tuple[str, ...]:
        """Balances in which a cause takes away a good part of what it takes away in all."""
        drop = self.residual(rest)**2 - self.residual(chosen)**2
        taken = {int(b): float(drop[self.stack.balance == b].sum())
                 for b in np.unique(self.stack.balance)}
        return tuple(BALANCES[b] for b, part in taken.items()
                     if part > 0.0 and part >= MAINLY * max(taken.values()))

    def explain(self, chosen: list[int]) -> list[Choice]:
        """Say of each choice what it gains and what could take its place."""
        answers = []
        for one in chosen:
            rest = [c for c in chosen if c != one]
            start = self.loss(rest)
            gain, significance = start - self.loss(chosen), self.significance(one, rest)
            alike = {}
            taken = {self.library.candidates[c].key for c in chosen}
            left = self._squares(chosen)
            for c, other in enumerate(list(self.library.candidates)):
                if other.key in taken:
                    continue
                share = (start - self.loss([*rest, c])) / max(gain, 1e-12)
                if share < ALIKE or share <= alike.get(other.key, (0.0, None))[0]:
                    continue
                closer = self.refined(c, rest)
                if self._as_good(self._squares([*rest, closer]), left, 1.5, 0.3):
                    alike[other.key] = (share, other)
            ranked = sorted(alike.values(), key=lambda pair: -pair[0])
            answers.append(Choice(self.library.candidates[one], gain, significance,
                                  self._taken(rest, chosen),
                                  tuple(other for _, other in ranked)))
        return answers


@dataclass
class _Line:
    """One shape of a candidate, moved on a line; remembers what it tried last."""

    screening: Screening
    chosen: list[int]
    start: Candidate
    shape: int
    size: np.ndarray
    logarithmic: bool
    version: Candidate | None = None
    table: np.ndarray | None = None

    def loss(self, at: float) -> float:
        """Return the cross-validated sum of squares with the shape there."""
        shapes = list(self.start.shapes)
        value = float(np.exp(at) if self.logarithmic else at)
        shapes[self.shape] = (shapes[self.shape][0], value)
        self.version = replace(self.start, shapes=tuple(shapes))
        self.table = self.screening.stack.columns(self.version, self.size)
        return self.screening._loss_with(self.chosen, self.version, self.table)
