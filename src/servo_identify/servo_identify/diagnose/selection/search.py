"""
The search for the set of mechanisms that predicts best.

A set grows by one mechanism while that gains more than chance would. Of all sets that predict as
well as the best, the smallest is the answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...fit.free_values import SURE
from ..decisions import CALIBRATED, FORM
from ..mechanisms.hypothesis import BY_RECORDING, UNKNOWN
from ..mechanisms.in_time import same_swing
from ..mechanisms.signal_scales import Scales
from .candidate_gains import Leavings
from .choice import Choice, Fitted
from .significance import Significance
from .worth import idle, worth

BEAM, SHORT_LIST = 4, 10  # sets that are followed, and candidates of each that are cross-validated
MOST = 5  # mechanisms in a set


class Search(Significance):
    """Grows and thins sets of hypotheses."""

    forms = 2  # of one mechanism on a short list

    def candidates(self, near: Fitted) -> list[tuple[bool, float, int, int]]:
        """
        Return (whether it pays, gain less cost in nats, number, side) of hypotheses beside a set.

        Those come first whose gain pays for one number at least: others are no answer, however
        little they cost.
        """
        regression = self.regression
        sums = self.sums(near.weight)
        weight = np.where(self.groups(near.held_out) > self.floor(), near.weight, 0.0)
        tables = {i: sums.parts[i][1] if row.all() else regression.table(i, row)
                  for i, row in enumerate(weight) if row.any()}
        prior = np.zeros(regression.size)
        every = np.arange(regression.size)
        prior[1:] = SURE**2 * self.doubts(near.doubt, sums, every) / regression.room[1:] ** 2
        floor = (weight * self.sizes * self.floor()).sum(axis=1)
        count = ((weight > 0.0) * self.sizes).sum(axis=1) * self.observations
        leavings = Leavings.of(sums, prior, tables, regression.where, floor, count)
        before = leavings.left(near.columns, near.values)
        squares = np.diag(sums.whole)
        known = np.zeros(regression.size)
        known[near.columns] = near.values
        found = []
        taken = {regression.hypotheses[n].mechanism.key for n in near.choice.numbers}
        paths = {regression.hypotheses[n].path for n in near.choice.numbers}
        for number, one in enumerate(regression.hypotheses):
            if one.mechanism.key in taken or (one.path and one.path in paths) or any(
                    same_swing(one, regression.hypotheses[n], self.duration)
                    for n in near.choice.numbers):
                continue
            columns, kept = self.columns_of(near.choice.plus(number, 0))
            for side in range(len(self._bounds[number])):
                low, high = self.bounds_of(near.choice.plus(number, side), kept)
                left, values = leavings.fitted(columns, low, high, known[columns[1:]])
                mine = slice(len(columns) - 1 - one.columns.size, None)
                at_work = one, values[mine], squares[columns[1:]][mine]
                cost = worth(*at_work) + idle(*at_work)
                gain = before - left
                found.append((gain > self.price, gain - cost * self.price, number, side))
        return sorted(found, reverse=True)

    @cached_property
    def duration(self) -> float:
        """Longest recording, s."""
        return Scales(self.regression.samples).duration

    def explain(self) -> Explanation:
        """Return the smallest set that predicts as well as the best, and what rivals it."""
        beam, best = [self.nothing], self.nothing
        for members in range(MOST):
            grown = self._grown(beam)
            better = next((one for one in grown if self.significant(best, one)), None)
            if better is None:
                break
            best = self._improved(better)
            # two effects may each look worse alone than one that is neither
            several = BEAM if members else SHORT_LIST
            beam = [best, *(one for one in grown if one is not best)][:several]
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
        if near.choice not in self._listed:
            self._listed[near.choice] = self._short_list(near)
        return self._listed[near.choice]

    @cached_property
    def _listed(self) -> dict[Choice, list[Choice]]:
        return {}

    def _short_list(self, near: Fitted) -> list[Choice]:
        listed: list[Choice] = []
        counted: dict[tuple[str, ...], int] = {}
        for *_, number, side in self.candidates(near):
            key = self.regression.hypotheses[number].mechanism.key
            if counted.get(key, 0) < self.forms:
                counted[key] = counted.get(key, 0) + 1
                listed.append(near.choice.plus(number, side))
            if len(listed) == SHORT_LIST:
                break
        return listed

    def _improved(self, fit: Fitted) -> Fitted:
        """Exchange one member for another that is needed while that predicts better."""
        for _ in range(MOST):
            better = fit
            for number in fit.choice.numbers:
                if len(fit.choice.numbers) < 2:
                    break
                rest = self.fitted(fit.choice.minus(number))
                for choice in self.short_list(rest):
                    other = self.fitted(choice)
                    if other.total < better.total and self.significant(rest, other):
                        better = other
            if better is fit:
                break
            fit = better
        return fit

    def _pruned(self, fit: Fitted) -> Fitted:
        """Take out what is not needed beside the others."""
        while fit.choice.members:
            rests = [self.fitted(fit.choice.minus(n)) for n in fit.choice.numbers]
            needless = [rest for rest in rests if not self.significant(rest, fit)]
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
                  if least <= len(one.choice.members) <= len(best.choice.members)
                  and self.beyond(one)]
        alike = []
        for one in rivals:
            if self.alike(one, best):
                alike.append(one)
        return min(alike, default=best, key=lambda f: (
            len(f.choice.members), self.nameless(f), self.evidence(f), len(f.columns)))

    def alike(self, one: Fitted, best: Fitted) -> bool:
        """
        Tell whether a set predicts all as well as the best, within one standard error or by form.

        By its form: it leaves no more than what the best form of a mechanism may be off.
        """
        whole, left, least = (self.power(each) for each in (self.nothing, one, best))
        if np.all(left <= np.maximum(CALIBRATED + FORM**2 * whole, (1.0 + FORM**2) * least)):
            return True
        lost = self.lost(one, best)  # each equation by its own error: one may not hide another
        return bool(np.all(lost[:, 0] + one.cost - best.cost <= lost[:, 1:].std(axis=1)))

    def evidence(self, fit: Fitted) -> float:
        """
        Return what a set leaves and what it costs where each block is one observation, nats.

        Without any floor: it tells sets apart that are alike within the form of a mechanism. What
        hardly acts costs as well here: it is no reason to prefer what has it.
        """
        left = np.log(np.maximum(self.groups(fit.held_out), 1e-12))
        return float(0.5 * (self._blocks_of * left).sum()
                     + self.price * (fit.numbers + self.idle(fit)) + fit.far)

    def nameless(self, fit: Fitted) -> int:
        """How many members of a set have no name, or differ by recording without saying why."""
        members = (self.regression.hypotheses[n].mechanism for n in fit.choice.numbers)
        return sum(one.name == UNKNOWN or BY_RECORDING in one.variables for one in members)

    @property
    def singles(self) -> list[Fitted]:
        """The sets of one member that predict better than none, the best first."""
        several = [one for one in self._known.values()
                   if len(one.choice.members) == 1 and one.total < self.nothing.total]
        return sorted(several, key=lambda one: one.total)


@dataclass(frozen=True)
class Explanation:
    """The set that predicts best, and the smallest that does as well."""

    best: Fitted
    smallest: Fitted
