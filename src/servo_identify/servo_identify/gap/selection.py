"""Which causes the recordings ask for: forward selection, pruned and swapped."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from heapq import heappop, heappush
from itertools import combinations, islice

import numpy as np
from scipy.stats import norm

from .comparison import as_good, complexity, SEEN, surely_worse
from .further_orders import take_in_further_orders
from .screening import Screening
from .shapes import all_refined, refined

CHANCE = 0.01  # that any of all candidates gets in by luck, per step
WORTH = 0.05  # share of a balance's remaining square that a cause must take away
MUCH = 0.25  # the same once much else is missing, where many laws take up a little
FAINT = 0.12  # and in squares of the scale, so that nothing is chased that does not matter
LATER = 0.004  # share of a balance's first square that a later cause must take away
STILL = 1.3  # square of a balance below which there is nothing left for a later cause
MOST = 6  # causes in one diagnosis
CLOSE = 0.7  # share of the best gain from which a candidate is refined before it is judged
REFINED = 5  # and how many of them
CLEAR = 4.0  # square of a balance that is a gap without doubt
HIDDEN = 0.5  # share of its first square that is left of a balance that no cause was found for
PASSED = 12  # candidates that are passed over so that another balance is heard
OPENS = 2.0  # times by which a cause may not raise the square of a balance, noise at least
SAME = 0.985  # share of the best gain that counts as no worse: then the simpler one
STRAIN = 0.5  # squares of tolerances by which values have to move less, for a cause to be likelier
FEW = 2  # causes up to which orders are read again, and another beginning is asked for
BEGUN = 8  # causes of which the best sets are begun with where much is left
MISSED = 0.03  # share of a balance's first square that is much
LESS = 0.5  # share of that which another beginning may leave
SHAPE = 0.15  # share of a cause's gain below which another law of its kind mends its shape only


@dataclass(frozen=True)
class Selection:
    """The choosing of causes from a screening."""

    screening: Screening

    @cached_property
    def _rows(self) -> list[np.ndarray]:
        """Rows, bool, by which it is judged what a cause takes away."""
        return list(self.screening.stack.showing(self._start).values())

    @cached_property
    def _start(self) -> np.ndarray:
        """Residual without any cause, at the weights of the beginning."""
        return self.screening.residual([])

    @cached_property
    def _limit(self) -> float:
        """Standard deviations above which a gain is no luck, of as many causes as are asked."""
        causes = len({c.key for c in self.screening.library.candidates})
        return float(norm.isf(CHANCE / max(1, causes)))

    def select(self, tick: Callable[[float], None]) -> list[int]:
        """
        Choose causes one by one until nothing more is worth it, pruning and swapping.

        Two or three causes that move the same balance may hide behind others that do a part of
        each. So where few were found and much is left, the best pair and the best three of those
        that did most at first are begun with.
        """
        screening = self.screening
        first = screening.squares([])
        chosen = self._grown([], tick)
        left = self._open(first, chosen)
        if left <= MISSED or len(chosen) > FEW:
            return self._of_their_own(chosen)
        weighed, alike = screening.weighed(), dict.fromkeys(first, 1.0)
        screening.weigh(alike)
        for some in self._sets():
            screening.weigh(alike)
            again = self.pruned(self._grown(self._again(some), lambda share: None))
            still = self._open(first, again)
            if still < LESS * left:
                chosen, left, weighed = again, still, screening.weighed()
        screening.weigh(weighed)
        return self._of_their_own(chosen)

    def _sets(self) -> list[list[int]]:
        """Return, of the causes that do most alone, the best two and the best three together."""
        foremost = [c for _, c in islice(self._ranked([], ()), BEGUN)]
        return [list(min(combinations(foremost, size), key=self.screening.loss))
                for size in (2, 3) if len(foremost) >= size]

    def _open(self, first: dict[int, float], chosen: list[int]) -> float:
        """Return the largest share of its first gap that is left of a balance, if it is clear."""
        left = self.screening.squares(chosen)
        return max(((square - 1.0) / (first[b] - 1.0) for b, square in left.items()
                    if first[b] >= square > CLEAR), default=0.0)

    def _grown(self, chosen: list[int], tick: Callable[[float], None]) -> list[int]:
        """Add causes to some until nothing more is worth it."""
        screening = self.screening
        first = screening.squares([])
        faint: set[tuple[str, str]] = set()
        been = {self._causes(chosen)}
        while len(chosen) < MOST:
            best = self._best(chosen, faint)
            if best is None:
                break
            if self._deserves(best, chosen, MUCH if faint else WORTH):
                tidied = self._tidied([*chosen, best], MUCH if faint else 0.0)
                if self._causes(tidied) in been:  # what came fell again, and would come again
                    break
                chosen = tidied
                been.add(self._causes(chosen))
                if faint:
                    screening.weigh(screening.squares(chosen))
                if len(chosen) <= FEW and self._shows(screening.residual(chosen)):
                    take_in_further_orders(screening, chosen)
                tick(len(chosen) / MOST)
            elif len(faint) < PASSED and self._drowned(first, chosen):
                if not faint:
                    screening.weigh(screening.squares(chosen))
                faint.add(screening.library.candidates[best].key)
            else:
                break
        if len(chosen) == FEW and self._open(first, chosen):
            chosen = self._again(chosen)  # a shape may have done a part of what came later
        return chosen

    def _shows(self, left: np.ndarray) -> bool:
        """Tell whether what is left of some balance is still a gap."""
        return any(float(np.mean(left[rows] ** 2)) > STILL for rows in self._rows)

    def _causes(self, chosen: list[int]) -> frozenset[tuple[str, str]]:
        """Return which causes some candidates are, whatever their shapes."""
        return frozenset(self.screening.library.candidates[c].key for c in chosen)

    def _deserves(self, best: int, chosen: list[int], least: float = WORTH) -> bool:
        """Tell whether a cause is worth it beside others where there still is a gap to see."""
        return (self._share(chosen, self.screening.residual([*chosen, best])) >= LATER
                and self._is_worth_it(best, chosen, least))

    def _drowned(self, first: dict[int, float], chosen: list[int]) -> bool:
        """Tell whether a balance has a clear gap that was hidden so far by that of another."""
        left = self.screening.squares(chosen)
        return any(CLEAR < square < max(left.values()) and square > HIDDEN * first[b]
                   for b, square in left.items())

    def _best(self, chosen: list[int], passed: Collection[tuple[str, str]] = ()) -> int | None:
        screening = self.screening
        close = self._foremost(chosen, passed)
        if not close:
            return None
        start = screening.loss(chosen)
        gains = {c: start - screening.loss([*chosen, c])
                 for c in all_refined(screening, close, chosen)}
        # among what leaves as little in every balance, the simplest
        most = max(gains, key=gains.get)
        least = screening.squares([*chosen, most])
        left = {c: screening.squares([*chosen, c]) for c in gains}
        near = [c for c in gains if not surely_worse(screening, c, most, chosen)
                and (as_good(left[c], least, 1.2, 0.15)
                     or (gains[c] >= SAME * gains[most]
                         and as_good(left[c], least, 1.6, 0.5)))]
        best = min(near, key=lambda c: (complexity(screening, c), -gains[c]))
        alike = [c for c in gains if gains[c] >= SAME * gains[best]
                 and as_good(left[c], left[best], *SEEN)
                 and complexity(screening, c) == complexity(screening, best)]
        if len(alike) > 1:
            best = self._least_strained(best, alike, chosen)
        return refined(screening, best, chosen, closely=True)

    def _least_strained(self, best: int, alike: list[int], chosen: list[int]) -> int:
        """
        Return, of the best cause and those that do as well and are as simple, the likeliest.

        Values are rarely at the ends of their tolerances: a cause that holds only where they are
        (a current sensor that reads too much for a drive that gives too much, the torque
        constant as far off the other way) gives way to one that leaves them where they were.
        """
        strain = {c: self.screening.strain([*chosen, c]) for c in alike}
        least = min(strain, key=strain.get)
        return least if strain[least] < strain[best] - STRAIN else best

    def _of_their_own(self, chosen: list[int]) -> list[int]:
        """
        Return the causes that do more than mend the shape of another.

        No law of a catalogue is quite that of a machine: what it leaves, another law of the same
        variables or of the same order at the same place takes up in part. Only now that all are
        found: while they are sought, a less fitting one would stand in for it.
        """
        screening = self.screening
        now = screening.loss(chosen)
        gains = {c: screening.loss([o for o in chosen if o != c]) - now for c in chosen}
        laws = {c: screening.library.candidates[c] for c in chosen}
        return [c for c in chosen if all(
            gains[c] >= SHAPE * gains[o] for o in chosen if laws[c].takes_shape_of(laws[o]))]

    def pruned(self, chosen: list[int]) -> list[int]:
        """
        Return those of some causes that are worth it beside each other, the least asked first.

        One that was taken beside others, which fell since, may have been there for them alone.
        """
        screening, kept = self.screening, list(chosen)
        for one in sorted(chosen, key=lambda c: screening.loss([o for o in chosen if o != c])):
            rest = [c for c in kept if c != one]
            if not self._deserves(one, rest):
                kept = rest
        return kept

    def _foremost(self, chosen: list[int], passed: Collection[tuple[str, str]]) -> list[int]:
        """
        Return the candidates that gain about as much as the best of them.

        One that opens a gap where there was none is no cause, though another might close it.
        """
        screening = self.screening
        close: list[int] = []
        before, most = screening.squares(chosen), 0.0
        for gain, c in self._ranked(chosen, passed):
            if len(close) == REFINED or gain < CLOSE * most:
                break
            after = screening.squares([*chosen, c])
            if all(after[b] <= OPENS * max(1.0, square) for b, square in before.items()):
                most = max(most, gain)
                close.append(c)
        return close

    def _ranked(self, chosen: list[int],
                passed: Collection[tuple[str, str]]) -> Iterator[tuple[float, int]]:
        """
        Yield (gain, best version) of each cause that is not chosen yet, falling.

        What a version gains at most is quickly known, so that few are asked what they do gain.
        """
        screening = self.screening
        start, library = screening.loss(chosen), screening.library.candidates
        taken = {library[c].key for c in chosen}.union(passed)
        at_most = [(start - screening.least([*chosen, c]), c)
                   for c, candidate in enumerate(library) if candidate.key not in taken]
        at_most.sort()
        known: list[tuple[float, int]] = []
        while at_most or known:
            if at_most and (not known or at_most[-1][0] > -known[0][0]):
                c = at_most.pop()[1]
                heappush(known, (screening.loss([*chosen, c]) - start, c))
                continue
            loss, c = heappop(known)
            if loss >= 0.0:
                return
            if library[c].key not in taken:
                taken.add(library[c].key)
                yield -loss, c

    def _tidied(self, chosen: list[int], least: float) -> list[int]:
        """
        Drop what later choices made needless; swap what another does better, a simpler as well.

        That other takes away at least a share ``least`` of what is left of a balance.
        """
        screening = self.screening
        for one in list(chosen):
            rest = [c for c in chosen if c != one]
            if not rest or one not in chosen:
                continue
            alone = self._again(rest)
            if not self._is_worth_it(one, alone):
                chosen = alone
                continue
            if not self._is_worth_it(one, rest):
                chosen = rest
                continue
            better = self._best(rest)
            if better is not None and better != one:
                gain = screening.loss(rest) - screening.loss(chosen)
                other = screening.loss(rest) - screening.loss([*rest, better])
                worth = self._worth(screening.residual(rest),
                                    screening.residual([*rest, better]))
                simpler = complexity(screening, better) < complexity(screening, one)
                if other > (SAME if simpler else 1.02) * gain and worth >= least:
                    chosen = [*rest, better]
        return chosen

    def _is_worth_it(self, one: int, rest: list[int], least: float = WORTH) -> bool:
        """Tell whether a cause takes away, for sure, a share that counts of what others leave."""
        screening = self.screening
        before, after = screening.residual(rest), screening.residual([*rest, one])
        return self._worth(before, after) >= least and screening.is_sure(one, rest, self._limit)

    def _again(self, chosen: list[int]) -> list[int]:
        """Return the same causes at the sizes and shapes that fit best without any other."""
        for one in chosen:
            rest = [c for c in chosen if c != one]
            chosen = [*rest, refined(self.screening, one, rest, closely=True)]
        return chosen

    def _worth(self, before: np.ndarray, after: np.ndarray) -> float:
        """
        Return the largest share that any balance loses of its remaining square.

        Drops too faint to matter count as nothing.
        """
        drop, most = before**2 - after**2, 0.0
        for rows in self._rows:
            taken = float(np.mean(drop[rows]))
            if taken > FAINT and float(np.mean(before[rows] ** 2)) > 1.0:
                most = max(most, taken / float(np.mean(before[rows] ** 2)))
        return most

    def _share(self, chosen: list[int], after: np.ndarray) -> float:
        """
        Largest share of a balance's first gap that a step takes away.

        A later cause needs a gap that still shows; the first may be as faint as the noise allows.
        """
        screening = self.screening
        before, shares = screening.residual(chosen), []
        for rows in self._rows:
            gap = float(np.sum(self._start[rows] ** 2))
            if float(np.mean(before[rows] ** 2)) <= (STILL if chosen else 1.0):
                continue
            shares.append(float(np.sum(before[rows] ** 2 - after[rows] ** 2)) / max(gap, 1e-12))
        return max(shares, default=0.0)
