"""
The search for the set of mechanisms that predicts best.

A set grows by one mechanism while that gains more than chance would. Of all sets that predict as
well as the best, the smallest is the answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS

from ..decisions import ALTERNATIVE, CALIBRATED, FALSE_ALARM, FORM, OPEN, WORTH
from ..mechanisms.hypothesis import UNKNOWN
from .fits import Choice, Fits, Fitted, SURE

BEAM, SHORT_LIST = 4, 10  # sets that are followed, and candidates of each that are cross-validated
DRAWS = 400  # sign flips behind the null distribution
MOST = 5  # mechanisms in a set
APART = 1e-4  # share of its square that a column must have beside others to count as its own


class Search(Fits):
    """Compares sets of hypotheses."""

    def candidates(self, near: Fitted) -> list[tuple[float, int, int]]:
        """Return (gain less cost, number, side) of each hypothesis beside a set, best first."""
        regression, sums = self.regression, self.sums(near.weight)
        found = []
        taken = {regression.hypotheses[n].mechanism.key for n in near.choice.numbers}
        paths = {regression.hypotheses[n].path for n in near.choice.numbers}
        for number, one in enumerate(regression.hypotheses):
            if one.mechanism.key in taken or (one.path and one.path in paths):
                continue
            worth = self._amplitudes(one, np.ones(one.columns.size, dtype=bool))
            for side in range(len(one.bounds())):
                choice = near.choice.plus(number, side)
                columns, kept = self.columns_of(choice)
                gram = sums.whole[columns[:, None], columns]
                low, high = self.bounds_of(choice, kept)
                doubts = self.doubts(near.doubt, sums, columns)
                prior = SURE**2 * doubts / self.room(kept, len(columns) - 1) ** 2
                values = np.concatenate(([1.0], self._solved(gram, prior, low, high)))
                left = float(values @ gram @ values + prior @ values[1:] ** 2)
                found.append((left + worth * np.log(max(2, regression.blocks)), number, side))
        at = near.columns
        start = float(near.values @ sums.whole[at[:, None], at] @ near.values)
        doubts = self.doubts(near.doubt, sums, at)
        room = self.room(self.columns_of(near.choice)[1], len(at) - 1)
        start += float(SURE**2 * doubts @ (near.values[1:] / room) ** 2)
        return sorted(((start - left, number, side) for left, number, side in found),
                      reverse=True)

    def explain(self) -> Explanation:
        """Return the smallest set that predicts as well as the best, and what rivals it."""
        beam, best = [self.nothing], self.nothing
        for _ in range(MOST):
            grown = self._grown(beam)
            if not grown or not self._significant(best, grown[0]):
                break
            best = self._improved(grown[0])
            beam = [best, *(one for one in grown if one is not best)][:BEAM]
        best = self._pruned(best)
        near = self._improved(self._smaller(best))
        smallest = self._smaller(near)
        for _ in range(MOST):  # until none with one member exchanged is preferred
            for number in smallest.choice.numbers:
                for choice in self.short_list(self.fitted(smallest.choice.minus(number))):
                    self.fitted(choice)
            before, smallest = smallest, self._smaller(near)
            if smallest is before:
                break
        return Explanation(near, smallest)

    def _grown(self, beam: list[Fitted]) -> list[Fitted]:
        """Return the sets with one more mechanism than those of the beam, best first."""
        found: dict[Choice, Fitted] = {}
        for near in beam:
            for choice in self.short_list(near):
                found[choice] = self.fitted(choice)
        unique: dict[frozenset[tuple[int, int]], Fitted] = {}
        for one in sorted(found.values(), key=lambda f: f.total):
            unique.setdefault(frozenset(one.choice.members), one)
        return list(unique.values())

    def short_list(self, near: Fitted) -> list[Choice]:
        listed: list[Choice] = []
        counted: dict[tuple[str, ...], int] = {}
        for _, number, side in self.candidates(near):
            key = self.regression.hypotheses[number].mechanism.key
            if counted.get(key, 0) < 2:
                counted[key] = counted.get(key, 0) + 1
                listed.append(near.choice.plus(number, side))
            if len(listed) == SHORT_LIST:
                break
        return listed

    def _improved(self, fit: Fitted) -> Fitted:
        """Exchange one member for another while that predicts better."""
        for _ in range(MOST):
            better = fit
            for number in fit.choice.numbers:
                if len(fit.choice.numbers) < 2:
                    break
                rest = self.fitted(fit.choice.minus(number))
                for choice in self.short_list(rest):
                    other = self.fitted(choice)
                    better = min(better, other, key=lambda f: f.total)
            if better is fit:
                break
            fit = better
        return fit

    def _pruned(self, fit: Fitted) -> Fitted:
        """Take out what is not needed beside the others."""
        while fit.choice.members:
            rests = [self.fitted(fit.choice.minus(n)) for n in fit.choice.numbers]
            needless = [rest for rest in rests if not self._significant(rest, fit)]
            if not needless:
                break
            fit = min(needless, key=lambda f: f.total)
        return fit

    def _smaller(self, best: Fitted) -> Fitted:
        """
        Return the set with fewer numbers that predicts as well, within one standard error.

        That something is there was tested before: where the best set is not empty, none is.
        """
        least = min(1, len(best.choice.members))
        rivals = [one for one in self._known.values()
                  if least <= len(one.choice.members) <= len(best.choice.members)]
        alike = []
        for one in rivals:
            if self.alike(one, best):
                alike.append(one)
        return min(alike, default=best, key=lambda f: (
            len(f.choice.members), self._nameless(f), self.evidence(f), len(f.columns)))

    def alike(self, one: Fitted, best: Fitted) -> bool:
        """
        Tell whether a set predicts as well as the best, within one standard error or by its form.

        By its form: it leaves no more than what the best form of a mechanism may be off.
        """
        whole, left, least = (self._power(each) for each in (self.nothing, one, best))
        if np.all(left <= np.maximum(CALIBRATED + FORM**2 * whole, (1.0 + FORM**2) * least)):
            return True
        lost = self.lost(one, best)
        return bool(lost[0] + one.cost - best.cost <= np.std(lost[1:]))

    def evidence(self, fit: Fitted) -> float:
        """
        Return what a set leaves and what it costs where each block is one observation, nats.

        Without any floor: it tells sets apart that are alike within the form of a mechanism.
        """
        left = np.log(np.maximum(self.groups(fit.held_out), 1e-12))
        return float(0.5 * (self._blocks_of * left).sum()
                     + 0.5 * np.log(max(2, self.regression.blocks)) * fit.numbers)

    def _power(self, fit: Fitted) -> np.ndarray:
        """Mean square that a set leaves in each equation."""
        size = np.maximum(self.sizes.sum(axis=1), 1.0)
        return (self.groups(fit.held_out) * self.sizes).sum(axis=1) / size

    def _nameless(self, fit: Fitted) -> int:
        """How many members of a set have no name."""
        return sum(self.regression.hypotheses[n].mechanism.name == UNKNOWN
                   for n in fit.choice.numbers)

    def lost(self, fit: Fitted, best: Fitted) -> np.ndarray:
        """
        Return how much worse one set predicts than another, nats: as seen, then resampled.

        What either leaves below the floor does not count. Blocks are resampled within each
        family of excitation, shape (1 + DRAWS,).
        """
        floor = self.floor()[:, None, :]
        sizes = self._drawn(self.regression.counts)
        several = []
        for one in (fit, best):
            with np.errstate(invalid='ignore', divide='ignore'):
                left = np.where(sizes > 0, self._drawn(one.held_out) / sizes, 0.0)
            several.append(np.log(np.maximum(left, floor)))
        return 0.5 * (sizes * (several[0] - several[1])).sum(axis=(0, 2))

    def _drawn(self, errors: np.ndarray) -> np.ndarray:
        """Sum by equation, draw and family what is known by equation and block."""
        family = self.regression.family
        return np.stack([errors[:, family == f] @ self._draws[:, family == f].T
                         for f in range(len(self.regression.families))], axis=2)

    @cached_property
    def _draws(self) -> np.ndarray:
        """How often each draw takes each block, (1 + DRAWS, blocks); the first takes each once."""
        chance, family = np.random.default_rng(0), self.regression.family
        counts = np.ones((1 + DRAWS, self.regression.blocks))
        for f in range(len(self.regression.families)):
            mine = np.flatnonzero(family == f)
            if len(mine):
                counts[1:, mine] = chance.multinomial(len(mine), np.full(len(mine), 1 / len(mine)),
                                                      DRAWS)
        return counts

    def _significant(self, before: Fitted, after: Fitted) -> bool:
        """
        Tell whether a gain is more than the best of all hypotheses would have by chance.

        Where an equation is certainly off, something is there: its first name needs less.
        """
        level = ALTERNATIVE if before is self.nothing and self.off else FALSE_ALARM
        gain = self.gain(before, after)
        return (after.total < before.total and self._worth(before, after)
                and gain > self.chance(before, after, level))

    @property
    def singles(self) -> list[Fitted]:
        """The sets of one member that predict better than none, the best first."""
        several = [one for one in self._known.values()
                   if len(one.choice.members) == 1 and one.total < self.nothing.total]
        return sorted(several, key=lambda one: one.total)

    @cached_property
    def off(self) -> set[str]:
        """The equations that are off by more than noise and margin can make them."""
        power = self._power(self.nothing)
        return {EQUATIONS[e] for e, square in zip(self.regression.equations, power, strict=True)
                if square > OPEN**2}

    def _worth(self, before: Fitted, after: Fitted) -> bool:
        """Tell whether new members close a part of the gap of an equation that is worth naming."""
        whole, first, last = (self.excess(one) for one in (self.nothing, before, after))
        return bool(np.any((first - last > WORTH * whole) & self._acts(before, after)))

    def excess(self, fit: Fitted) -> np.ndarray:
        """Root mean square above the calibrated floor that a set leaves in each equation."""
        left = np.maximum(0.0, self.groups(fit.held_out) - CALIBRATED)
        size = np.maximum(self.sizes.sum(axis=1), 1.0)
        return np.sqrt((left * self.sizes).sum(axis=1) / size)

    def _acts(self, before: Fitted, after: Fitted) -> np.ndarray:
        """Tell in which equations new members have columns."""
        new = [self.regression.members[n] for n in after.choice.numbers
               if n not in before.choice.numbers]
        return np.array([any((where[members] >= 0).any() for members in new)
                         for where in self.regression.where])

    def gain(self, before: Fitted, after: Fitted) -> float:
        """Return what a set gains in the equations in which its new members act, nats."""
        floor, acts = self.floor(), self._acts(before, after)
        ratio = np.log(np.maximum(self.groups(before.held_out), floor)
                       / np.maximum(self.groups(after.held_out), floor))
        return float(0.5 * (self.sizes * ratio)[acts].sum())

    def chance(self, before: Fitted, after: Fitted, level: float = FALSE_ALARM) -> float:
        """
        Return the gain that the best hypothesis reaches by chance at a level, nats.

        What the larger set leaves has its sign drawn block by block: a pattern of the same
        noise without any effect. The gain of each hypothesis is that of its columns, unbounded,
        in the groups where more is left than the floor.
        """
        regression = self.regression
        weight = np.where(self.groups(before.held_out) > self.floor(), after.weight, 0.0)
        whole = self.sums(weight).whole
        known = before.columns[1:]
        known = known[np.diag(whole)[known] > 0.0]
        several = [np.setdiff1d(members, known) for members in regression.members]
        wanted = np.concatenate([known, *several]).astype(int)
        scores = regression.scores_of(after.columns, after.values, wanted, weight)
        flips = np.random.default_rng(0).choice((-1.0, 1.0), (DRAWS, regression.blocks))
        drawn = flips @ scores
        gram = whole[wanted[:, None], wanted]
        size = len(known)
        inner = gram[:size, :size] + 1e-9 * np.diag(np.maximum(np.diag(gram)[:size], 1e-300))
        across = np.linalg.solve(inner, gram[:size]) if size else np.zeros((0, len(wanted)))
        left = drawn - drawn[:, :size] @ across
        most, at = np.zeros(DRAWS), size
        for members in several:
            mine = slice(at, at + len(members))
            at += len(members)
            if not len(members):
                continue
            square = gram[mine, mine] - gram[mine, :size] @ across[:, mine]
            own = np.diag(square) > APART * np.diag(gram)[mine]
            if not own.any():
                continue  # what the known columns do already
            weight = np.sqrt(np.diag(square)[own])
            scaled = np.linalg.pinv(square[np.ix_(own, own)] / np.outer(weight, weight),
                                    rcond=APART)
            part = left[:, mine][:, own] / weight
            most = np.maximum(most, 0.5 * np.einsum('di,ij,dj->d', part, scaled, part))
        return float(np.quantile(most, 1.0 - level))


@dataclass(frozen=True)
class Explanation:
    """The set that predicts best, and the smallest that does as well."""

    best: Fitted
    smallest: Fitted
