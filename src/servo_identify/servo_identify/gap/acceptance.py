"""An explanation is kept as far as the twin, run anew on other recordings, is better for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .balance import Balance, BALANCES
from .explanation import Explanation, fit
from .regression import less
from .resimulation import Diverged, Gap, gap_of, resimulate
from .screening import Screening
from .side_by_side import side_by_side
from .stack import NOTICED, Stack

AT_LEAST = 0.05  # shrink of a channel's gap that counts
MATTERS = 0.5  # share of the whole gap from which a channel that gets worse counts
WORSE = 0.10  # growth of a channel's gap that does not do
DECISIVE = 0.5  # shrink of a balance's gap that outweighs a channel that drifts a little more
UNHURT = 0.02  # by which the whole gap may grow all the same
HARM = 0.01  # growth of a gap, as a share of the channel's signal, that matters to anyone
BY_BALANCE = 0.3  # shrink of a balance's gap that counts where the channels are too coarse


@dataclass(frozen=True)
class Trial:
    """A twin with some causes in it, run over some recordings."""

    explanation: Explanation
    gap: Gap


def tried(screening: Screening, chosen: list[int], balances: list[Balance],
          near: Explanation | None = None) -> Trial:
    """
    Fit a set of causes on the screen recordings and run the twin over other ones.

    ``near`` is as for :func:`fit`. Raises Diverged.
    """
    explanation = fit(screening, chosen, near)
    return Trial(explanation, run_over(explanation, balances))


def run_over(explanation: Explanation, balances: list[Balance]) -> Gap:
    """Run the twin with an explanation over recordings and return its gaps. Raises Diverged."""
    return gap_of([resimulate(one, explanation.theta, explanation.on) for one in balances],
                  balances)


def accept(screening: Screening, chosen: list[int], balances: list[Balance], others: Stack,
           tick: Callable[[float], None]) -> tuple[list[int], list[str]]:
    """
    Return (the causes that stand, why others fell).

    Each is taken out in turn, the rest refitted: its twin must leave a larger gap in a channel (or
    in a balance, where the channel does not resolve it), and with it no channel may get worse.
    """
    kept, fallen = list(chosen), []
    full = _tried_or_none(screening, kept, balances)
    for round_number in range(len(chosen)):
        rests = [[c for c in kept if c != one] for one in kept]
        near = full.explanation if full else None
        trials = side_by_side(
            lambda rest, near=near: _tried_or_none(screening, rest, balances, near), rests)
        verdicts = [_judge(without, full, others) for without in trials]
        tick((round_number + 1) / max(1, len(chosen)))
        failing = [(gain, one, why) for one, (passes, gain, why) in
                   zip(kept, verdicts, strict=True) if not passes]
        if not failing:
            break
        _, worst, why = min(failing)
        fallen.append(f'{screening.library.candidates[worst].label} was screened but does not '
                      f'stand on the accept recordings: {why}')
        kept.remove(worst)
        full = _tried_or_none(screening, kept, balances)
    return kept, fallen


def _tried_or_none(screening, chosen, balances, near=None) -> Trial | None:
    try:
        return tried(screening, chosen, balances, near)
    except Diverged:
        return None


def _judge(without: Trial | None, full: Trial | None,
           others: Stack) -> tuple[bool, float, str]:
    if full is None:
        return False, -1.0, 'the twin with it diverges'
    if without is None:
        return True, 1.0, ''
    best, worst = 0.0, 0.0
    whole = full.gap.total(without.gap)
    for channel in full.gap.squares:
        before, after = without.gap.excess(channel), full.gap.excess(channel)
        floor = full.gap.floor[channel]
        if before > 0.2 * floor:
            low, high = _interval(without.gap, full.gap, channel)
            drop = 1.0 - after / before
            best = max(best, drop if low > 0.0 else 0.0)
            # a channel that was near perfect may lose what does not matter
            signal = full.gap.signal[channel]
            if high < 0.0 and after > MATTERS * whole * signal and after - before > HARM * signal:
                worst = max(worst, -drop)
    balance = _by_balance(without, full, others)
    first = without.gap.total(without.gap)
    drop = 1.0 - whole / first if first > 0.0 else 0.0
    if balance >= DECISIVE and drop > -UNHURT:
        return True, balance, ''
    if worst > WORSE:
        return False, balance, f'a channel gets worse by {100 * worst:.0f} %'
    if best >= AT_LEAST or balance >= BY_BALANCE:
        return True, balance, ''
    return False, balance, (f'it shrinks no channel by more than {100 * best:.0f} %, '
                         f'no balance by more than {100 * balance:.0f} %')


def _interval(before: Gap, after: Gap, channel: str) -> tuple[float, float]:
    chance = np.random.default_rng(0)
    size = len(before.squares[channel])
    drops = []
    for _ in range(200):
        blocks = chance.integers(0, size, size)
        first = before.excess(channel, blocks)
        drops.append(1.0 - after.excess(channel, blocks) / first if first > 0.0 else 0.0)
    return float(np.percentile(drops, 5)), float(np.percentile(drops, 95))


def _by_balance(without: Trial, full: Trial, others: Stack) -> float:
    """Largest share by which a cause, as fitted elsewhere, shrinks the gap of a balance."""
    first = leftover(others, without.explanation)
    second = leftover(others, full.explanation)
    best = 0.0
    for name, rows in others.showing(first, NOTICED).items():
        before, after = float(np.mean(first[rows]**2)), float(np.mean(second[rows]**2))
        drop = np.bincount(others.block[rows], first[rows]**2 - second[rows]**2)
        drop = drop[np.bincount(others.block[rows]) > 0]
        sure = drop.sum() > 1.6 * np.sqrt(len(drop)) * np.std(drop)
        shrinks = 1.0 - after / before if before > 1.2 and sure else 0.0
        # a family alone may show what the laws of a twin and a rig differ by at a creep
        if np.array_equal(rows, others.balance == BALANCES.index(name)) or shrinks >= DECISIVE:
            best = max(best, shrinks)
    return best


def leftover(others: Stack, explanation: Explanation) -> np.ndarray:
    """Return the residuals of other recordings under an explanation fitted elsewhere."""
    residual = others.at(explanation.theta, explanation.on)
    labels, columns, low, high = others.nuisances()
    free = [i for i, label in enumerate(labels) if label not in others.extended.servo.values]
    return less(residual, columns[:, free], low[free], high[free])
