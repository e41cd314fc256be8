"""Everything that was seen of a gap and of its causes, from which verdict and page are made."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from servo_twin.physics.servo import Servo

from .acceptance import leftover, run_over, Trial, tried
from .ambiguity import Choice, explain
from .augmented import augmented
from .balance import Balance, BALANCES
from .completeness import Remainder, remainder, repeatable
from .explanation import Explanation, fit
from .resimulation import Diverged, Gap
from .screening import Screening
from .side_by_side import side_by_side
from .splitting import Split
from .stack import NOTICED, Stack
from .stages import Stages

ERRATIC = 4.0  # mean square of what is left that no sensor made, though no replicate shares it


@dataclass(frozen=True)
class Findings:
    """
    What is known before any cause is taken.

    ``purposes`` and ``stacks`` are balances and residuals by purpose, ``start`` the residuals of
    the screen recordings with no cause, ``given`` the gap on the report recordings with the servo
    file as it came, ``base`` the twin with its values within tolerance and ``bare`` its gap on the
    report recordings, ``reading`` the channel whose wrong reading would be all that departs
    ('' where there is none), ``disputed`` by balance the variables of a law that did more than the
    cause that was found there.
    """

    servo: Servo
    split: Split
    purposes: dict[str, list[Balance]]
    stacks: dict[str, Stack]
    start: np.ndarray
    given: Gap
    base: Trial
    bare: Gap
    reading: str
    disputed: dict[str, tuple[str, ...]]


@dataclass(frozen=True)
class Evidence:
    """Everything behind a report that the page draws."""

    servo: Servo
    augmented: Servo
    split: Split
    stacks: dict[str, Stack]
    start: np.ndarray
    left: np.ndarray
    choices: tuple[Choice, ...]
    base: Trial
    best: Trial
    remainders: tuple[Remainder, ...]
    reported: dict
    reading: str = ''
    disputed: dict[str, tuple[str, ...]] = field(default_factory=dict)


def gathered(known: Findings, screening: Screening, kept: list[int], stages: Stages) -> Evidence:
    """Fit some causes, run the twin with them, and describe what they leave."""
    purposes, stacks = known.purposes, known.stacks
    best = tried(screening, kept, purposes['accept'])
    names = tuple(f'{r.name}@{r.digest[:12]}' if r.digest else r.name for r in known.split.screen)
    better = augmented(known.servo, stacks['screen'], best.explanation, names)
    choices = tuple(explain(screening, kept))
    stages.begin('completeness')
    left = screening.residual(kept)
    remainders = _remainders(stacks, left, best, bool(kept), known.disputed)
    stages.begin('shrink')
    reported = {
        'given': known.given,
        'base': known.bare,
        'best': run_over(best.explanation, purposes['report']),
        'steps': _steps(screening, kept, purposes, best.explanation),
        'left': leftover(stacks['report'], best.explanation),
    }
    return Evidence(known.servo, better, known.split, stacks, known.start, left, choices,
                    known.base, best, remainders, reported, known.reading, known.disputed)


def _remainders(stacks: dict[str, Stack], left: np.ndarray, best: Trial, found: bool,
                disputed: dict[str, tuple[str, ...]]) -> tuple[Remainder, ...]:
    """Describe what is left in each balance that shows a gap, or in which a law is disputed."""
    screen, accepting = stacks['screen'], stacks['accept']
    open_ones = [BALANCES[i] for i in np.unique(screen.balance)
                 if np.mean(left[screen.balance == i]**2) > NOTICED or BALANCES[i] in disputed]
    remainders = [remainder(screen, left, b, disputed.get(b, ())) for b in open_ones]
    common = repeatable(screen, left, accepting, leftover(accepting, best.explanation))
    return tuple(replace(r, predictable=_unexplained(r, common, found)) for r in remainders)


def _unexplained(left: Remainder, common: dict[str, float], found: bool) -> float:
    """
    Mean square that some law must explain.

    With replicates what they have in common, without them what a regressor predicts; but where
    nothing was found, or nothing could be compared, so much that no sensor can have made it is a
    gap though erratic.
    """
    erratic = left.square - 1.0 if left.square > ERRATIC else 0.0
    if left.balance in common:
        return max(left.predictable, common[left.balance], 0.0 if found else erratic)
    return max(left.predictable, erratic)


def _steps(screening: Screening, kept: list[int], purposes: dict,
           best: Explanation) -> list[dict]:
    """Gaps with the causes added one by one, and with each alone and left out."""
    def gaps(chosen: tuple[int, ...]) -> dict:
        explanation = fit(screening, list(chosen), best)
        try:
            return {purpose: run_over(explanation, purposes[purpose])
                    for purpose in ('accept', 'report')}
        except Diverged:  # a part of the causes alone need not be a machine that runs
            return gaps(())

    ways = [{'upto': tuple(sorted(kept[:number + 1])), 'alone': (one,),
             'rest': tuple(sorted(c for c in kept if c != one))}
            for number, one in enumerate(kept)]
    sets = sorted({chosen for way in ways for chosen in way.values()})
    found = dict(zip(sets, side_by_side(gaps, sets), strict=True))
    return [{purpose: {name: found[chosen][purpose] for name, chosen in way.items()}
             for purpose in ('accept', 'report')} for way in ways]
