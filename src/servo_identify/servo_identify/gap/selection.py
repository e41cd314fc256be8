"""
Which causes the recordings ask for: forward selection, pruned, and what could stand in for each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from .balance import BALANCES
from .candidates import Candidate
from .screening import Screening
from .shapes import refined

CHANCE = 0.01  # that any of all candidates gets in by luck, per step
WORTH = 0.05  # share of a balance's remaining square that a cause must take away
FAINT = 0.12  # and in squares of the scale, so that nothing is chased that does not matter
LATER = 0.004  # share of a balance's first square that a later cause must take away
STILL = 1.3  # square of a balance below which there is nothing left for a later cause
MOST = 6  # causes in one diagnosis
MAINLY = 0.3  # share of the most that a cause takes away in one balance, for another to count
CLOSE = 0.7  # share of the best gain from which a candidate is refined before it is judged
REFINED = 5  # and how many of them
OPENS = 2.0  # times by which a cause may not raise the square of a balance, noise at least
SURELY = 3.5  # standard deviations over blocks by which the better of two laws is told
LITTLE = 0.05  # and the share of what it leaves, or all laws but the exact one were surely worse
SAME = 0.985  # share of the best gain that counts as no worse: then the simpler one
SHAPE = 0.15  # share of a cause's gain below which another law of its kind mends its shape only
ALIKE = 0.9  # share of a cause's gain that another must reach to be called ambiguous with it
SEEN = (1.2, 0.05)  # times and squares of the scale by which one leaves more, so that it is seen
LIKELY = 2.0  # standard deviations over blocks by which a richer law must leave less to be listed


@dataclass(frozen=True)
class Choice:
    """A cause that the screening took, with what else would have done."""

    candidate: Candidate
    gain: float  # cross-validated drop of the sum of squares
    significance: float  # standard deviations of the drop over blocks
    balances: tuple[str, ...] = ()  # those in which it takes most away
    ambiguous: tuple[Candidate, ...] = ()


@dataclass(frozen=True)
class Selection:
    """The choosing of causes from a screening."""

    screening: Screening

    def select(self, tick: Callable[[float], None]) -> list[int]:
        """Choose causes one by one until nothing more is worth it, pruning and swapping."""
        screening = self.screening
        chosen: list[int] = []
        causes = len({c.key for c in screening.library.candidates})
        limit = norm.isf(CHANCE / max(1, causes))
        start = current = screening.residual(chosen)
        for step in range(MOST):
            best = self._best(chosen)
            if best is None:
                break
            after = screening.residual([*chosen, best])
            if screening.significance(best, chosen) < limit or self._worth(current, after) < WORTH:
                break
            if self._share(start, current, after) < LATER:
                break
            chosen.append(best)
            chosen = self._tidied(chosen, limit)
            current = screening.residual(chosen)
            tick((step + 1) / MOST)
        return self._of_their_own(chosen)

    def explain(self, chosen: list[int]) -> list[Choice]:
        """Say of each choice what it gains and what could take its place."""
        screening = self.screening
        answers = []
        for one in chosen:
            rest = [c for c in chosen if c != one]
            gain = screening.loss(rest) - screening.loss(chosen)
            ranked = sorted(self._alike(one, chosen, gain), key=lambda pair: -pair[0])
            answers.append(Choice(screening.library.candidates[one], gain,
                                  screening.significance(one, rest), self._taken(rest, chosen),
                                  tuple(other for _, other in ranked)))
        return answers

    def _alike(self, one: int, chosen: list[int],
               gain: float) -> Iterator[tuple[float, Candidate]]:
        """Yield (share of the gain, version) of each other cause that could be there instead."""
        screening = self.screening
        rest = [c for c in chosen if c != one]
        start, shares = screening.loss(rest), {}
        taken = {screening.library.candidates[c].key for c in chosen}
        for c, other in enumerate(screening.library.candidates):
            if other.key in taken:
                continue
            share = (start - screening.loss([*rest, c])) / max(gain, 1e-12)
            if share >= ALIKE:
                shares.setdefault(other.key, []).append((share, c))
        for versions in shares.values():
            for share, c in sorted(versions, reverse=True):
                if self.stands_in(one, refined(screening, c, rest), rest):
                    yield share, screening.library.candidates[c]
                    break

    def stands_in(self, one: int, other: int, rest: list[int]) -> bool:
        """
        Tell whether these recordings leave open that another cause is there instead of one.

        It may leave no more that counts in any balance, nor surely more where a recording shows
        it. One with more numbers must be likely to leave less: as good as anything is its limit
        at which it is the simpler law, and no recording could tell it from that.
        """
        screening = self.screening
        kept, instead = [*rest, one], [*rest, other]
        if not self._as_good(screening.squares(instead), screening.squares(kept), 1.5, 0.3):
            return False
        if self._complexity(other) > self._complexity(one):
            drop = screening.residual(kept)**2 - screening.residual(instead)**2
            return self._sureness(drop) > LIKELY
        return max(self.shown(kept, instead).values()) <= 1.0 or not self._surely_worse(
            other, one, rest)

    def shown(self, kept: list[int], instead: list[int]) -> dict[int, float]:
        """
        Return by recording how plainly it shows that other causes leave more than those kept.

        Mean squares of what they leave over the least that is seen, in the balance in which that
        is most: above 1 it is seen.
        """
        stack, screening = self.screening.stack, self.screening
        least, left = screening.residual(kept)**2, screening.residual(instead)**2
        times, more = SEEN
        ratios: dict[int, float] = {}
        for number in np.unique(stack.recording):
            for index in np.unique(stack.balance):
                rows = (stack.recording == number) & (stack.balance == index)
                if rows.any():
                    ratio = float(np.mean(left[rows]) / (times * np.mean(least[rows]) + more))
                    ratios[int(number)] = max(ratio, ratios.get(int(number), 0.0))
        return ratios

    def _sureness(self, drop: np.ndarray) -> float:
        """Return a sum of what rows lose in standard deviations, over blocks."""
        drop = np.bincount(self.screening.blocks, drop)
        return float(drop.sum() / (np.sqrt(len(drop)) * np.std(drop) + 1e-12))

    def _best(self, chosen: list[int]) -> int | None:
        screening = self.screening
        taken = {screening.library.candidates[c].key for c in chosen}
        start, by_key = screening.loss(chosen), {}
        for c, candidate in enumerate(screening.library.candidates):
            if candidate.key not in taken:
                gain = start - screening.loss([*chosen, c])
                if gain > by_key.get(candidate.key, (0.0, 0))[0]:
                    by_key[candidate.key] = (gain, c)
        close = self._foremost(sorted(by_key.values(), reverse=True), screening.squares(chosen),
                               chosen)
        if not close:
            return None
        gains = {}
        for c in close:
            better = refined(screening, c, chosen)
            gains[better] = start - screening.loss([*chosen, better])
        # among what leaves as little in every balance, the simplest
        most = max(gains, key=gains.get)
        least = screening.squares([*chosen, most])
        left = {c: screening.squares([*chosen, c]) for c in gains}
        near = [c for c in gains if not self._surely_worse(c, most, chosen)
                and (self._as_good(left[c], least, 1.2, 0.15)
                     or (gains[c] >= SAME * gains[most]
                         and self._as_good(left[c], least, 1.6, 0.5)))]
        best = min(near, key=lambda c: (self._complexity(c), -gains[c]))
        return refined(screening, best, chosen, closely=True)

    def _of_their_own(self, chosen: list[int]) -> list[int]:
        """
        Return the causes that do more than mend the shape of another.

        No law of a catalogue is quite that of a machine: what it leaves, another law of the same
        variables at the same place takes up in part. Only now that all are found: while they are
        sought, a less fitting one would stand in for it.
        """
        screening = self.screening
        now = screening.loss(chosen)
        gains = {c: screening.loss([o for o in chosen if o != c]) - now for c in chosen}
        kinds = {c: screening.library.candidates[c].kind for c in chosen}
        return [c for c in chosen if kinds[c] is None or all(
            gains[c] >= SHAPE * gains[o] for o in chosen if kinds[o] == kinds[c])]

    def _surely_worse(self, one: int, most: int, chosen: list[int]) -> bool:
        """Tell whether a candidate leaves more than another in a balance, little but for sure."""
        screening = self.screening
        stack = screening.stack
        behind = screening.residual([*chosen, one])**2 - screening.residual([*chosen, most])**2
        left = screening.residual([*chosen, most])**2
        for index in np.unique(stack.balance):
            rows = stack.balance == index
            drop = np.bincount(screening.blocks[rows], behind[rows])
            sure = drop.sum() > SURELY * np.sqrt(len(drop)) * np.std(drop)
            if sure and drop.sum() > LITTLE * float(np.sum(left[rows])):
                return True
        return False

    def _foremost(self, ranked: list[tuple[float, int]], before: dict[int, float],
                  chosen: list[int]) -> list[int]:
        """
        Return the candidates that gain about as much as the best of them.

        One that opens a gap where there was none is no cause, though another might close it.
        """
        screening = self.screening
        close: list[int] = []
        most = 0.0
        for gain, c in ranked:
            if len(close) == REFINED or gain < CLOSE * most:
                break
            after = screening.squares([*chosen, c])
            if all(after[b] <= OPENS * max(1.0, square) for b, square in before.items()):
                most = max(most, gain)
                close.append(c)
        return close

    def _tidied(self, chosen: list[int], limit: float) -> list[int]:
        """Drop what later choices made needless; swap what another now does better."""
        screening = self.screening
        for one in list(chosen):
            rest = [c for c in chosen if c != one]
            if not rest or one not in chosen:
                continue
            alone = self._again(rest)
            before, after = screening.residual(alone), screening.residual([*alone, one])
            if screening.significance(one, alone) < limit or self._worth(before, after) < WORTH:
                chosen = alone
                continue
            before, after = screening.residual(rest), screening.residual(chosen)
            if screening.significance(one, rest) < limit or self._worth(before, after) < WORTH:
                chosen = rest
                continue
            better = self._best(rest)
            if better is not None and better != one:
                gain = screening.loss(rest) - screening.loss(chosen)
                other = screening.loss(rest) - screening.loss([*rest, better])
                if other > 1.02 * gain:
                    chosen = [*rest, better]
        return chosen

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
        screening = self.screening
        drop, most = before**2 - after**2, 0.0
        for index in np.unique(screening.stack.balance):
            rows = screening.stack.balance == index
            taken = float(np.mean(drop[rows]))
            if taken > FAINT and float(np.mean(before[rows] ** 2)) > 1.0:
                most = max(most, taken / float(np.mean(before[rows] ** 2)))
        return most

    def _share(self, start: np.ndarray, before: np.ndarray, after: np.ndarray) -> float:
        """
        Largest share of a balance's first gap that a step takes away.

        A later cause needs a gap that still shows; the first may be as faint as the noise allows.
        """
        screening = self.screening
        shares = []
        for index in np.unique(screening.stack.balance):
            rows = screening.stack.balance == index
            gap = float(np.sum(start[rows] ** 2))
            if float(np.mean(before[rows] ** 2)) <= (1.0 if before is start else STILL):
                continue
            shares.append(float(np.sum(before[rows] ** 2 - after[rows] ** 2)) / max(gap, 1e-12))
        return max(shares, default=0.0)

    def _complexity(self, one: int) -> int:
        """
        How many numbers a candidate may choose.

        A shape with a grid is one, an order too: it was read off the residual.
        """
        screening = self.screening
        shapes = screening.library.candidates[one].shapes
        return len(screening.members[one]) + sum(
            bool(screening.stack.extended.declaration(path).grid) for path, _ in shapes)

    @staticmethod
    def _as_good(left: dict[int, float], least: dict[int, float], times: float,
                 more: float) -> bool:
        return all(square <= times * least[b] + more for b, square in left.items())

    def _taken(self, rest: list[int], chosen: list[int]) -> tuple[str, ...]:
        """Balances in which a cause takes away a good part of what it takes away in all."""
        screening = self.screening
        drop = screening.residual(rest)**2 - screening.residual(chosen)**2
        taken = {int(b): float(drop[screening.stack.balance == b].sum())
                 for b in np.unique(screening.stack.balance)}
        return tuple(BALANCES[b] for b, part in taken.items()
                     if part > 0.0 and part >= MAINLY * max(taken.values()))
