"""Whether one set of mechanisms predicts better than another by more than chance would."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS

from ..decisions import ALTERNATIVE, CALIBRATED, FALSE_ALARM, WORTH
from ..residuals.nuisance import untold_ratio
from .bounded_least_squares import most_gained
from .choice import Choice, Fitted
from .fits import Fits
from .regression import Regression

DRAWS = 400  # sign flips behind the null distribution
KEPT = 64  # sets whose resampled errors are kept
APART = 1e-4  # share of its square that a column must have beside others to count as its own


def acts_in(regression: Regression, number: int) -> np.ndarray:
    """Tell in which equations a hypothesis has columns, (equations,)."""
    return np.array([(where[regression.members[number]] >= 0).any() for where in regression.where])


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
        apart = self._logs(fit) - self._logs(best)
        return 0.5 * self.observations[:, None] * (self._drawn_sizes * apart).sum(axis=2)

    def _logs(self, fit: Fitted) -> np.ndarray:
        """Log of what a set leaves by equation, draw and family; the last few are kept."""
        if fit.choice not in self._known_logs:
            while len(self._known_logs) >= KEPT:
                self._known_logs.pop(next(iter(self._known_logs)))
            sizes = self._drawn_sizes
            with np.errstate(invalid='ignore', divide='ignore'):
                left = np.where(sizes > 0, self._drawn(fit.held_out) / sizes, 0.0)
            self._known_logs[fit.choice] = np.log(np.maximum(left, self.floor()[:, None, :]))
        return self._known_logs[fit.choice]

    @cached_property
    def _known_logs(self) -> dict[Choice, np.ndarray]:
        return {}

    @cached_property
    def _drawn_sizes(self) -> np.ndarray:
        return self._drawn(self.regression.counts)

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

        Where an equation is certainly off, something is there: its first name needs less. Else the
        smaller set must be less likely than an explanation that is not listed.
        """
        certain = before is self.nothing and bool(self.off)
        level, least = (ALTERNATIVE, 0.0) if certain else (FALSE_ALARM, -np.log(ALTERNATIVE))
        return (before.total - after.total > least and self._worth(before, after)
                and self.beyond(after)
                and self.gain(before, after) > self.chance(before, after, level))

    def beyond(self, fit: Fitted) -> bool:
        """Tell whether all values that a set moves leave the tolerance of the servo file."""
        regression = self.regression
        for number in fit.choice.numbers:
            low, high = self._spans.get(regression.hypotheses[number].path, (0.0, 0.0))
            if low < high:
                change = fit.values[np.isin(fit.columns, regression.members[number])]
                if len(change) and low <= change[0] <= high:
                    return False
        return True

    @cached_property
    def _spans(self) -> dict[str, tuple[float, float]]:
        """The tolerances of the values of the servo file, by path, and what no encoder tells."""
        nuisance, least = self.regression.nuisance, untold_ratio(self.regression.samples)
        spans = zip(nuisance.low, nuisance.high, strict=True)
        return {'mechanism.ratio': (-least, least)} | dict(
            zip(nuisance.labels, spans, strict=True))

    @cached_property
    def off(self) -> set[str]:
        """The equations that are off by more than noise and margin can make them."""
        return self.off_in(self.nothing)

    def off_in(self, fit: Fitted) -> set[str]:
        """Return the equations in which a set leaves more than noise and margin can make."""
        return {EQUATIONS[e] for e, square, least in zip(
            self.regression.equations, self.power(fit), self.open_from, strict=True)
            if square > least}

    @cached_property
    def open_from(self) -> np.ndarray:
        """Mean square from which each equation is certainly off, (equations,)."""
        return np.array([self.regression.samples.open_from(EQUATIONS[e])
                         for e in self.regression.equations])

    def _worth(self, before: Fitted, after: Fitted) -> bool:
        """Tell whether new members close a part worth naming of what others leave of a gap."""
        first, last = self.excess(before), self.excess(after)
        return bool(np.any((first - last > WORTH * first) & self.acts(before, after)))

    def excess(self, fit: Fitted) -> np.ndarray:
        """Root mean square above the calibrated floor that a set leaves in each equation."""
        left = np.maximum(0.0, self.groups(fit.held_out) - CALIBRATED)
        size = np.maximum(self.sizes.sum(axis=1), 1.0)
        return np.sqrt((left * self.sizes).sum(axis=1) / size)

    def acts(self, before: Fitted, after: Fitted) -> np.ndarray:
        """Tell in which equations new members have columns."""
        new = [acts_in(self.regression, n) for n in after.choice.numbers
               if n not in before.choice.numbers]
        return np.any(new, axis=0) if new else np.zeros(len(self.sizes), bool)

    def gain(self, before: Fitted, after: Fitted) -> float:
        """Return what a set gains in the equations in which its new members act, nats."""
        floor, acts = self.floor(), self.acts(before, after)
        ratio = np.log(np.maximum(self.groups(before.held_out), floor)
                       / np.maximum(self.groups(after.held_out), floor))
        return float(0.5 * (self.sizes * ratio)[acts].sum())

    def chance(self, before: Fitted, after: Fitted, level: float = FALSE_ALARM) -> float:
        """
        Return the gain that the best hypothesis reaches by chance at a level, nats.

        What the larger set leaves has its sign drawn block by block: a pattern of the same
        noise without any effect. The gain of each hypothesis is that of its columns within their
        bounds, in the groups where more is left than the floor. An equation in which the new
        members do not act, and something else is certainly missing, is left out: that is no noise.
        All are in which they do not act, where one in which they do is certainly off: chance
        elsewhere says nothing of it.
        """
        regression = self.regression
        told = self.acts(before, after)
        if not np.any(told & (self.power(before) > self.open_from)):
            told = told | (self.power(after) <= self.open_from)
        there = told[:, None] & (self.groups(before.held_out) > self.floor())
        weight = np.where(there, after.weight, 0.0)
        whole = self.sums(weight).whole
        known = before.columns[1:]
        known = known[np.diag(whole)[known] > 0.0]
        several = [np.setdiff1d(members, known) for members in regression.members]
        wanted = np.concatenate([known, *several]).astype(int)
        scores = regression.scores_of(after.columns, after.values, wanted, weight)
        drawn = self._flips @ scores
        gram = whole[wanted[:, None], wanted]
        size = len(known)
        inner = gram[:size, :size] + 1e-9 * np.diag(np.maximum(np.diag(gram)[:size], 1e-300))
        across = np.linalg.solve(inner, gram[:size]) if size else np.zeros((0, len(wanted)))
        left = drawn - drawn[:, :size] @ across
        most, at, one_sided = np.zeros(DRAWS), size, []
        for number, members in enumerate(several):
            mine = slice(at, at + len(members))
            at += len(members)
            if not len(members):
                continue
            square = gram[mine, mine] - gram[mine, :size] @ across[:, mine]
            own = np.diag(square) > APART * np.diag(gram)[mine]
            if not own.any():
                continue  # what the known columns do already
            weight = np.sqrt(np.diag(square)[own])
            square = square[np.ix_(own, own)] / np.outer(weight, weight)
            part = left[:, mine][:, own] / weight
            gains = 0.5 * (part @ np.linalg.pinv(square, rcond=APART) * part).sum(axis=1)
            one = regression.hypotheses[number]
            if one.signs.any():
                kept = np.isin(regression.members[number], members)
                one_sided.append((gains, square, part, [
                    (low[kept][own] * weight, high[kept][own] * weight)
                    for low, high in one.bounds()]))
            else:
                most = np.maximum(most, gains)
        for gains, square, part, bounds in one_sided:
            larger = np.flatnonzero(gains > most)  # without bounds; within them it is less
            most[larger] = np.maximum(most[larger], most_gained(
                square, part[larger], *map(np.array, zip(*bounds, strict=True))))
        return float(np.quantile(most, 1.0 - level))

    @cached_property
    def _flips(self) -> np.ndarray:
        """The sign of each block in each draw, (DRAWS, blocks)."""
        return np.random.default_rng(0).choice((-1.0, 1.0), (DRAWS, self.regression.blocks))
