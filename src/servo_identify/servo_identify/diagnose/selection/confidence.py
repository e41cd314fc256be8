"""
How sure the choice is: amplitudes over resampled blocks, and sets that predict as well.

Both come from the sums of products of the regression. Blocks are resampled within each family of
excitation.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np

from ...fit.free_values import SURE
from ..decisions import ALTERNATIVE, FORM
from ..mechanisms.hypothesis import Mechanism, UNKNOWN
from ..mechanisms.patterns import SPEED_FRICTION
from .choice import Choice, Fitted
from .explain import Explained
from .regression import solve
from .worth import working

ROUNDING = 1e-4  # share by which columns that are the same differ
REDRAWN = 60  # fits behind the bands of curves and amplitudes


@dataclass(frozen=True)
class Rival:
    """Another explanation in the place of a member: its hypothesis, side and confidence."""

    number: int
    side: int
    mechanism: Mechanism
    confidence: float


def redrawn(found: Explained, fit: Fitted | None = None) -> np.ndarray:
    """
    Return the unknowns of fits on resampled blocks, shape (REDRAWN, unknowns).

    The order is that of ``fit.columns[1:]``.
    """
    search, fit = found.search, fit or found.explanation.smallest
    regression = search.regression
    kept = search.columns_of(fit.choice)[1]
    low, high = search.bounds_of(fit.choice, kept)
    room = search.room(kept, len(fit.columns) - 1)
    products = regression.of(fit.columns)
    doubts = search.doubts(fit.doubt, products.sums(fit.weight), np.arange(len(fit.columns)))
    prior = SURE**2 * doubts / room**2
    chance, values = np.random.default_rng(0), []
    members = [np.flatnonzero(regression.family == f) for f in range(len(regression.families))]
    for _ in range(REDRAWN):
        times = np.zeros(regression.blocks)
        for mine in members:
            if len(mine):
                times[mine] = chance.multinomial(len(mine), np.full(len(mine), 1 / len(mine)))
        gram = products.drawn(times, fit.weight)
        gram[np.arange(1, len(gram)), np.arange(1, len(gram))] += prior
        values.append(solve(gram, low, high))
    return np.array(values)


def preferred(found: Explained) -> tuple[Explained, dict[int, tuple[float, list[Rival]]]]:
    """
    Return the answer with each member exchanged for a rival that is surer, once.

    With it, :func:`rivals_of` for each member, by its number.
    """
    found = by_values(found)
    known: dict[int, tuple[float, list[Rival]]] = {}
    for number in found.explanation.smallest.choice.numbers:
        confidence, rivals = known[number] = rivals_of(found, number)
        rival = surer(found.hypotheses[number].mechanism.name, confidence, rivals)
        if rival:
            # beside another member the others are to be judged again
            found, known = exchanged(found, number, rival), {}
    return found, {number: known.get(number) or rivals_of(found, number)
                   for number in found.explanation.smallest.choice.numbers}


def exchanged(found: Explained, number: int, rival: Rival) -> Explained:
    """Return the answer with a rival in the place of a member."""
    rest = found.explanation.smallest.choice.minus(number)
    other = found.search.fitted(rest.plus(rival.number, rival.side))
    return replace(found, explanation=replace(found.explanation, smallest=other))


def surer(name: str, confidence: float, rivals: list[Rival]) -> Rival | None:
    """
    Return the rival that is surer than a member of this name, if one is.

    The name counts first, wherever it acts: what may act at either shaft is one cause. Then the
    place.
    """
    names = defaultdict(float, {name: confidence})
    for one in rivals:
        names[one.mechanism.name] += one.confidence
    surest = max(names, key=lambda known: names[known])
    best = next((one for one in rivals if one.mechanism.name == surest), None)
    return best if best and (surest != name or best.confidence > confidence) else None


def by_values(found: Explained) -> Explained:
    """
    Return the answer with each curve that says no more than a value of the file exchanged for it.

    What the curve does better then is less than a form may be off.
    """
    search, best = found.search, found.explanation.best
    for number in found.explanation.smallest.choice.numbers:
        if found.hypotheses[number].path:
            continue
        rest = found.explanation.smallest.choice.minus(number)
        for choice in _swaps(found, rest, number):
            other = next(n for n in choice.numbers if n not in rest.numbers)
            fit = search.fitted(choice)
            if (found.hypotheses[other].path and search.beyond(fit) and search.alike(fit, best)
                    and _same(found, number, other, fit)):
                found = replace(found, explanation=replace(found.explanation, smallest=fit))
                break
    return found


def rivals_of(found: Explained, number: int) -> tuple[float, list[Rival]]:
    """
    Return (confidence of a member of the chosen set, what else could stand in its place).

    The confidence set of models: of all sets that differ from the chosen one in this member alone,
    how often each predicts best when the blocks are resampled (Hansen, Lunde, Nason 2011). Two
    that the form of a mechanism may be off by share what they win together.
    """
    search, chosen = found.search, found.explanation.smallest
    rest = chosen.choice.minus(number)
    own = found.hypotheses[number].mechanism
    best = found.explanation.best

    def rank(fit: Fitted) -> tuple[bool, int, float]:
        if search.alike(fit, best):
            return False, search.nameless(fit), search.evidence(fit)
        return True, 0, fit.total

    contest: dict[tuple[str, ...], tuple[Fitted, int, int]] = {}
    for choice in _swaps(found, rest, number):
        fit = search.fitted(choice)
        index, side = next(m for m in choice.members if m[0] not in rest.numbers)
        key = found.hypotheses[index].mechanism.key
        if key not in contest or rank(fit) < rank(contest[key][0]):
            contest[key] = fit, index, side
    keys = list(contest)
    fits = [contest[key][0] for key in keys]
    lost = np.array([search.lost(fit, chosen).sum(axis=0) + fit.cost - chosen.cost
                     for fit in fits])
    wins = np.bincount(np.argmin(lost[:, 1:], axis=0), minlength=len(keys)) / lost[:, 1:].shape[1]
    alike = np.array([search.alike(fit, best) and (
        contest[key][0] is chosen or found.hypotheses[contest[key][1]].mechanism.name != UNKNOWN
        or own.name == UNKNOWN) for key, fit in zip(keys, fits, strict=True)])
    nameless = np.array([found.hypotheses[contest[key][1]].mechanism.name == UNKNOWN
                         for key in keys])
    if own.name != UNKNOWN and alike.any():  # a named one stands where it predicts alike
        wins[alike] += wins[nameless].sum() / alike.sum()
        wins[nameless] = 0.0
    if alike.any():  # what is told apart by less than a form may be off is not told apart
        wins[alike] = wins[alike].sum() * _shares(np.array(
            [search.evidence(fit) for fit, same in zip(fits, alike, strict=True) if same]))
    several = [Rival(contest[key][1], contest[key][2], found.hypotheses[contest[key][1]].mechanism,
                     float(share)) for key, share in zip(keys, wins, strict=True)]
    same = [one.mechanism.key == own.key or _same(found, number, one.number, fit)
            for one, fit in zip(several, fits, strict=True)]
    mine = sum(one.confidence for one, is_mine in zip(several, same, strict=True) if is_mine)
    others = [one for one, is_mine in zip(several, same, strict=True) if not is_mine
              and one.mechanism.name != UNKNOWN and one.confidence >= ALTERNATIVE]
    return mine, sorted(others, key=lambda one: -one.confidence)


def _same(found: Explained, number: int, other: int, fit: Fitted) -> bool:
    """
    Tell whether a hypothesis says the same as one of the chosen set, under another name.

    It is a value of the file (or one that hardly varies), or friction over speed of any form, on
    the same variables of the same place, and does in ``fit`` the same to residuals. Two laws are
    two causes, though they do alike: a spring is no weight, and a clearance that grows with the
    load no softer spring. A law of which but one term does anything, and that the same, is none
    beside it: a spring without stiffness is a constant torque.
    """
    pair = [found.hypotheses[n] for n in (number, other)]
    one, two = (hypothesis.mechanism for hypothesis in pair)
    if (one.port, one.site) == (two.port, two.site) and _one_term_alone(found, number, other, fit):
        return True
    paths = {hypothesis.path for hypothesis in pair}
    if len(paths - {''}) > 1:
        return False
    value = paths != {''}
    varies, also = set(one.variables), set(two.variables)
    alike = varies <= also or also <= varies if value else varies == also
    if one.site != two.site or not alike or not (
            value or SPEED_FRICTION in (one.name, two.name)):
        return False
    return _do_alike(found, number, other, found.amplitudes(other, fit))


def _one_term_alone(found: Explained, number: int, other: int, fit: Fitted) -> bool:
    """Tell whether one of several terms is the member's own, and the others do nothing."""
    regression, amplitudes = found.search.regression, found.amplitudes(other, fit)
    gram = regression.of(regression.members[other]).sums(found.explanation.smallest.weight).whole
    works = working(amplitudes, np.diag(gram))
    return len(works) > 1 and works.sum() == 1 and _do_alike(
        found, number, other, np.where(works, amplitudes, 0.0), ROUNDING)


def _do_alike(found: Explained, number: int, other: int, amplitudes: np.ndarray,
              off: float = FORM) -> bool:
    """Tell whether a hypothesis does to residuals what a member does, but for a share ``off``."""
    regression, chosen = found.search.regression, found.explanation.smallest
    several = [regression.members[n] for n in (number, other)]
    gram = regression.of(np.concatenate(several)).sums(chosen.weight).whole
    values = np.zeros((2, len(gram)))
    size = len(several[0])
    values[0, :size] = found.amplitudes(number)
    values[1, size:] = amplitudes
    (x, xy), (_, y) = values @ gram @ values.T
    return bool(xy > 0.0 and xy**2 > (1.0 - off**2) * x * y)


def _shares(evidence: np.ndarray) -> np.ndarray:
    """Return the shares of sets that predict alike, by their evidence in nats (the less)."""
    share = np.exp(np.min(evidence) - evidence)
    return share / share.sum()


def _swaps(found: Explained, rest: Choice, number: int) -> list[Choice]:
    """Return the sets with another member (or the same) in the place of one."""
    search = found.search
    near = search.fitted(rest)
    swaps = {choice: None for choice in search.short_list(near)}
    mine = next(m for m in found.explanation.smallest.choice.members if m[0] == number)
    swaps[rest.plus(*mine)] = None
    return list(swaps)
