"""
What the equations do not tell apart, the simulation may.

A clearance that grows with the load and a spring that is softer at small torque have the same
curve. In motion they differ: the gap follows the load late, and the spring pushes back. So each of
the names that the equations leave is handed over, and what the simulation says is added to what
the equations say.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .answer.evidence import Finding
from .decisions import ALTERNATIVE, MENTION
from .handed import Handed
from .handover.gap import Gap
from .selection.confidence import exchanged, Rival, rivals_of
from .selection.explain import Explained

MOST = 2  # rivals that are handed over: each takes as long as the answer itself
LEAST = 1e-6  # share that a member has at least, for its logarithm

Known = Mapping[int, tuple[float, list[Rival]]]
"""By the number of a member, how sure it is and its rivals."""


@dataclass(frozen=True)
class Contest:
    """An answer of the equations, and how sure each of its members is."""

    found: Explained
    known: Known

    @property
    def member(self) -> int | None:
        """The member that does most, of those with rivals in its place; None without one."""
        search, fit = self.found.search, self.found.explanation.smallest
        return max((number for number in self.known if self._rivals(number)), default=None,
                   key=lambda number: search.fitted(fit.choice.minus(number)).total)

    def slim(self) -> Contest:
        """Return the same with the columns of the answer and of its rivals alone."""
        number = self.member
        rivals = [] if number is None else self._rivals(number)
        return replace(self, found=self.found.slim([one.number for one in rivals]))

    def decided(self, hand: Callable[[Explained, Known, Callable[[float], None]], Handed],
                tick: Callable[[float], None] = lambda share: None) -> Handed:
        """
        Return the answer, or that with a rival, for which equations and simulation speak most.

        ``hand(found, known, tick)`` hands an answer over. The simulation speaks on the accept
        recordings, by the nearer of two files: the other values as given, or fitted beside each.
        """
        number = self.member
        if number is None:
            return hand(self.found, self.known, tick)
        rivals = self._rivals(number)
        answers = [(number, self.found, self.known)]
        for one in rivals:
            other = exchanged(self.found, number, one)
            answers.append((one.number, other, {
                n: rivals_of(other, n) for n in other.explanation.smallest.choice.numbers}))
        count = len(answers)
        handed = [hand(found, known, partial(_share, tick, n, count))
                  for n, (_, found, known) in enumerate(answers)]
        gaps = [min((one.handover.gaps[name] for name in ('patch', 'refit')), key=Gap.total)
                for one in handed]
        given = handed[0].handover.gaps['given']
        nats = np.array([gaps[0].evidence(gap, given) for gap in gaps])
        nats[np.abs(nats) < MENTION] = 0.0
        shares = _logs([self.known[number][0], *(one.confidence for one in rivals)])
        best = int(np.argmax(shares + nats))
        keys = [self.found.hypotheses[n].mechanism.key for n, *_ in answers]
        return _surer(handed[best], answers[best][0], dict(zip(keys, nats, strict=True)))

    def _rivals(self, number: int) -> list[Rival]:
        """
        Return the rivals of a member that act where it does, the surest first.

        Where something acts the equations tell: the memory of a late reading or command begins
        unknown with each stretch that is simulated, and speaks against it.
        """
        own = self.found.hypotheses[number].mechanism
        if own.outside:
            return []
        return [one for one in self.known[number][1]
                if one.mechanism.site == own.site and not one.mechanism.outside][:MOST]


def _logs(shares: Sequence[float]) -> np.ndarray:
    return np.log(np.maximum(shares, LEAST))


def _share(tick: Callable[[float], None], number: int, count: int, share: float) -> None:
    tick((number + share) / count)


def _surer(handed: Handed, number: int, nats: Mapping[tuple[str, ...], float]) -> Handed:
    """Return an answer whose member is as sure as equations and simulation together have it."""
    own = nats[handed.found.hypotheses[number].mechanism.key]

    def told(one: Finding) -> Finding:
        if one.part.number != number:
            return one
        known = [one.confidence, *(rival.confidence for rival in one.rivals)]
        said = [0.0, *(nats.get(rival.mechanism.key, 0.0) - own for rival in one.rivals)]
        shares = _logs(known) + said
        shares = np.exp(shares - shares.max())
        shares *= sum(known) / shares.sum()
        rivals = [replace(rival, confidence=float(share))
                  for rival, share in zip(one.rivals, shares[1:], strict=True)]
        rivals.sort(key=lambda rival: -rival.confidence)
        kept = [rival for rival in rivals if rival.confidence >= ALTERNATIVE]
        return replace(one, confidence=float(shares[0]), rivals=tuple(kept),
                       beaten=tuple(rival.mechanism for rival in rivals[len(kept):]))

    return replace(handed, findings=tuple(map(told, handed.findings)))
