"""What the evidence amounts to: no gap, explained, in part or unknown; which causes are named."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .acceptance import leftover
from .ambiguity import Choice
from .balance import BALANCES
from .candidates import Candidate
from .completeness import Remainder
from .evidence import Evidence
from .resimulation import shrink
from .stack import NOTICED, Stack
from .wrong_reading import ENTERS

LAWFUL = 0.25  # predictable mean square, in squares of noise and margin: below, a gap is noise
OPEN = 0.1  # predictable share of a gap above which it is not explained
STILL = 0.6  # the same in squares of noise and margin, however large the gap was
WRONG = 0.28  # and above which what was found is not the cause
WRONG_VALUE = 0.05  # the same of a value: one that is off leaves nothing behind when it is right
ALONE = 0.02  # the same where only values are at work, no effect whose form may be another
FAR = 1000.0  # the same in squares of noise and margin: a sixth of all that acts is no detail,
NOT_FAR = ('controller',)  # but where errors add up, since the law runs on with no loop closed
WOUND = 0.75  # share of the gap of the wind-up that a twin with a law of the mesh may keep
BY_TORQUE = 5.0  # or times what its torque is off by, over the stiffness
TOLD = 0.05  # growth of the gap on the report recordings that refutes what was accepted
HOLDS = 0.5  # of the square of the balances there; if less is left, it stands all the same


@dataclass(frozen=True)
class Judgement:
    """
    A status and its reasons.

    ``squares`` is by balance what was there before any cause (mean squares of noise and margin),
    ``gaps`` the balances that have one; ``named`` the causes that are named, ``share`` what of the
    gap still follows a law that is not known here, ``worst`` where.
    """

    status: str
    squares: dict[str, float]
    gaps: set[str]
    named: tuple[Candidate, ...] = ()
    share: float = 0.0
    worst: Remainder | None = None


def judged(evidence: Evidence) -> Judgement:
    """
    Return the status that the evidence asks for, and what goes with it.

    A cause is named when its own balances are explained with it; another balance may be open.
    What only mends a cause that is not named is none either, nor is what stands in for a sensor
    that reads wrong.
    Where they close and yet the twin run anew is no nearer to the rig, that is a part only.
    """
    squares = squares_of(evidence.stacks['screen'], evidence.start)
    gaps = {b for b, square in squares.items() if square > NOTICED}
    lawful = {r.balance for r in evidence.remainders
              if r.predictable > LAWFUL and r.predictable > OPEN * (squares[r.balance] - 1.0)}
    if not evidence.choices and not gaps & lawful:
        if not evidence.disputed:
            return Judgement('no_gap', squares, gaps)
        gaps = set(evidence.disputed)  # one family shows it, and a law that is not known here
    total = sum(max(0.0, squares[b] - 1.0) for b in gaps) or 1.0
    still, worst = {}, None
    for one in evidence.remainders:
        excess = max(0.0, squares[one.balance] - 1.0)
        if one.balance not in gaps or excess < 0.05 * total or one.square < NOTICED:
            continue
        still[one.balance] = one.predictable / excess
        if still[one.balance] >= max(still.values()):
            worst = one
    share = max(still.values(), default=0.0)
    left = {r.balance: r.predictable for r in evidence.remainders if r.balance in still}
    wrong = [choice for choice in evidence.choices
             if _leaves_too_much(choice, evidence, still, left)
             or _is_a_piece(choice, evidence, left) or _mimics_reading(choice, evidence.reading)
             or _winds_up_otherwise(choice, evidence)]
    named = [choice.candidate for choice in evidence.choices
             if choice not in wrong and not any(_mends(choice, other) for other in wrong)]
    if not evidence.choices:
        worst = max((r for r in evidence.remainders if r.balance in gaps),
                    key=lambda r: r.predictable, default=None)
    if not named or _refuted(evidence, gaps):
        return Judgement('unknown', squares, gaps, (), share, worst)
    closed = share <= OPEN and max(left.values(), default=0.0) <= STILL
    if closed and len(named) == len(evidence.choices) and shrunk(evidence) > 0.0:
        return Judgement('explained', squares, gaps, tuple(named), share)
    return Judgement('partly_explained', squares, gaps, tuple(named), share, worst)


def _mimics_reading(choice: Choice, reading: str) -> bool:
    """Tell whether a cause would only do what a wrong reading ('' for none) does."""
    return set(choice.balances) <= set(ENTERS.get(reading, ()))


def _winds_up_otherwise(choice: Choice, evidence: Evidence) -> bool:
    """
    Tell whether a law of the mesh closes its balance, but not the gap of the twin's wind-up.

    The balance asks it by the wind-up that was measured. One that gives way to any wind-up closes
    it whatever moved the readings, an encoder that reads late as well; the twin, which has but its
    own torque to wind up by, does not follow.
    """
    before, after = evidence.reported['base'], evidence.reported['best']
    if not choice.candidate.bends_mesh or not {'wind_up', 'torque'} <= set(after.squares):
        return False
    stiffness = evidence.servo.values.get('mechanism.stiffness', 0.0)
    left, first = after.excess('wind_up'), before.excess('wind_up')
    return (first > after.floor['wind_up'] and left > WOUND * first
            and left * stiffness > BY_TORQUE * after.rms('torque'))


def _leaves_too_much(choice: Choice, evidence: Evidence, share: dict[str, float],
                     square: dict[str, float]) -> bool:
    """Tell whether what still follows a law in a cause's balances speaks against it."""
    for balance in choice.balances:
        left, most = square.get(balance, 0.0), WRONG
        if choice.candidate.switch is None:
            alone = all(other.candidate.switch is None for other in evidence.choices
                        if balance in other.balances)
            most = ALONE if alone and left > STILL else WRONG_VALUE
        if share.get(balance, 0.0) > most or (left > FAR and balance not in NOT_FAR):
            return True
    return False


def _is_a_piece(choice: Choice, evidence: Evidence, square: dict[str, float]) -> bool:
    """
    Tell whether a cause is one of several that together imitate another.

    Laws of the same variables at the same place can be put together to nearly any other; when they
    still leave something lawful, they are not what acts there.
    """
    kind = choice.candidate.kind
    alike = [o for o in evidence.choices if kind is not None and o.candidate.kind == kind]
    return len(alike) > 1 and any(square.get(b, 0.0) > STILL for b in choice.balances)


def _mends(one: Choice, other: Choice) -> bool:
    """Tell whether a cause takes from the same balance as another, and less: it mends that one."""
    return bool(set(one.balances) & set(other.balances)) and one.gain < other.gain


def _refuted(evidence: Evidence, gaps: set[str]) -> bool:
    """
    Tell whether the report recordings speak against what was accepted.

    Their balances resolve what no channel does: a cause that halves them stands.
    """
    if shrunk(evidence) >= -TOLD:
        return False
    stack = evidence.stacks['report']
    before, after = leftover(stack, evidence.base.explanation), evidence.reported['left']
    shown = stack.showing(before, NOTICED)
    # where no balance has a gap as a whole, the causes were found in those that they move
    asked = gaps or {b for choice in evidence.choices for b in choice.balances}
    rows = np.any([shown[b] for b in asked if b in shown], axis=0)
    return not rows.any() or float(np.mean(after[rows]**2)) > HOLDS * float(
        np.mean(before[rows]**2))


def shrunk(evidence) -> float:
    return shrink(evidence.reported['base'], evidence.reported['best'])


def squares_of(stack: Stack, residual: np.ndarray) -> dict[str, float]:
    """Return the mean square of a residual by balance, in squares of noise and margin."""
    return {BALANCES[i]: float(np.mean(residual[stack.balance == i]**2))
            for i in np.unique(stack.balance)}
