"""Whether one set of mechanisms predicts better than another by more than chance would."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS

from ..decisions import ALTERNATIVE, CALIBRATED, FALSE_ALARM, OPEN, WORTH
from .fits import Fits, Fitted

DRAWS = 400  # sign flips behind the null distribution
APART = 1e-4  # share of its square that a column must have beside others to count as its own


class Significance(Fits):
    """What sets gain over one another, and what chance would give them."""

    def power(self, fit: Fitted) -> np.ndarray:
        """Mean square that a set leaves in each equation."""
        size = np.maximum(self.sizes.sum(axis=1), 1.0)
        return (self.groups(fit.held_out) * self.sizes).sum(axis=1) / size

    def lost(self, fit: Fitted, best: Fitted) -> np.ndarray:
        """
        Return how much worse one set predicts each equation than another, nats of observations.

        As seen, then resampled: shape (equations, 1 + DRAWS). What either leaves below the floor
        does not count. Blocks are resampled within each family of excitation.
        """
        floor = self.floor()[:, None, :]
        sizes = self._drawn(self.regression.counts)
        several = []
        for one in (fit, best):
            with np.errstate(invalid='ignore', divide='ignore'):
                left = np.where(sizes > 0, self._drawn(one.held_out) / sizes, 0.0)
            several.append(np.log(np.maximum(left, floor)))
        return 0.5 * self.observations[:, None] * (sizes * (several[0] - several[1])).sum(axis=2)

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

    def significant(self, before: Fitted, after: Fitted) -> bool:
        """
        Tell whether a gain is more than the best of all hypotheses would have by chance.

        Where an equation is certainly off, something is there: its first name needs less.
        """
        level = ALTERNATIVE if before is self.nothing and self.off else FALSE_ALARM
        return (after.total < before.total and self._worth(before, after)
                and self.beyond(after)
                and self.gain(before, after) > self.chance(before, after, level))

    def beyond(self, fit: Fitted) -> bool:
        """Tell whether all values that a set moves leave the tolerance of the servo file."""
        regression = self.regression
        spans = {label: (low, high) for label, low, high in zip(
            regression.nuisance.labels, regression.nuisance.low, regression.nuisance.high,
            strict=True)}
        for number in fit.choice.numbers:
            low, high = spans.get(regression.hypotheses[number].path, (0.0, 0.0))
            change = fit.values[np.isin(fit.columns, regression.members[number])]
            if low < high and len(change) and low <= change[0] <= high:
                return False
        return True

    @cached_property
    def off(self) -> set[str]:
        """The equations that are off by more than noise and margin can make them."""
        power = self.power(self.nothing)
        return {EQUATIONS[e] for e, square in zip(self.regression.equations, power, strict=True)
                if square > OPEN**2}

    def _worth(self, before: Fitted, after: Fitted) -> bool:
        """Tell whether new members close a part worth naming of what others leave of a gap."""
        first, last = self.excess(before), self.excess(after)
        return bool(np.any((first - last > WORTH * first) & self._acts(before, after)))

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
        in the groups where more is left than the floor. An equation in which the new members do
        not act, and something else is certainly missing, is left out: that is no noise.
        """
        regression = self.regression
        told = self._acts(before, after) | (self.power(after) <= OPEN**2)
        there = told[:, None] & (self.groups(before.held_out) > self.floor())
        weight = np.where(there, after.weight, 0.0)
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
