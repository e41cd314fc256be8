"""
Effects that are smaller than the form of a larger one beside them may be off.

A search leaves alone what the best form of the effects that it found may leave. What depends on
other variables than these effects is not of their form. So the effects found are given any curve
over their own variables. What explains the rest beside all that is an effect of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS

from ..decisions import CALIBRATED, SOLVED
from ..mechanisms.hypothesis import Hypothesis, UNKNOWN
from .choice import Choice, Fitted
from .regression import Regression
from .search import Explanation, MOST, Search
from .significance import acts_in

SPEED_OF = {'direction': 'speed'}
"""Under which variable the patterns over another stand."""


def with_small_effects(search: Search, explanation: Explanation, made: Callable[
        [np.ndarray], list[Hypothesis]] | None = None) -> tuple[Search, Explanation]:
    """
    Return an explanation with the small effects beside it, and the search that found them.

    ``made(residual)`` makes the hypotheses again by what an explanation leaves: orders that the
    large effects hid are chosen by that. Without it, none are.
    """
    while 0 < len(explanation.smallest.choice.members) < MOST:
        chosen = explanation.smallest
        finer, names = _finer(search, chosen), {number: number for number in search.tried}
        if finer and made:
            again, names = _remade(search, chosen, made)
            chosen = again.fitted(_renamed(chosen.choice, names))
            finer = _finer(again, chosen)
        added = _added(finer, chosen.choice) if finer else None
        if finer is None or added is None:
            break
        for choice in search.choices:  # how the sets known so far fare by the new floor
            finer.fitted(_renamed(choice, names))
        search, explanation = finer, Explanation(added, added)
    return search, explanation


def _renamed(choice: Choice, names: Mapping[int, int]) -> Choice:
    return Choice(tuple((names[number], side) for number, side in choice.members))


def _remade(search: Search, found: Fitted, made: Callable[[np.ndarray], list[Hypothesis]]
            ) -> tuple[Search, dict[int, int]]:
    """
    Return a search among hypotheses with orders and places of what is left, and the new numbers.

    Beside them stand all that were tried so far, and the curves over one variable.
    """
    regression = search.regression
    fit = search.fitted(_freed(regression, found.choice))
    amplitudes = np.zeros(regression.size)
    amplitudes[fit.columns] = fit.values
    left = regression.samples.base + regression.nuisance.columns @ amplitudes[
        1:1 + regression.nuisance.columns.shape[1]]
    for number in fit.choice.numbers:
        left = left + (regression.hypotheses[number].columns.whole()
                       @ amplitudes[regression.members[number]])
    kept = [number for number, one in enumerate(regression.hypotheses)
            if number in search.tried or _is_pattern(one)]
    several = [regression.hypotheses[number] for number in kept]
    several += [one for one in made(left) if one.tried > 1 or 'narrowest' in one.detail]
    other = Search(Regression(regression.samples, regression.nuisance, several))
    return other, {number: place for place, number in enumerate(kept)}


def _finer(search: Search, found: Fitted) -> Search | None:
    """
    Return a search with the floor that is left where the form of the effects is free.

    None where nothing is left above it: there the form of the effects is all that is off.
    """
    regression = search.regression
    free = search.fitted(_freed(regression, found.choice))
    may_fall = [_may_be_freed(regression, found.choice, e)
                for e in range(len(regression.equations))]
    floor = np.where(np.array(may_fall)[:, None], np.minimum(
        search.floor(search.groups(free.held_out)), search.floor()), search.floor())
    open_ = (search.power(free) > CALIBRATED) & may_fall
    return Search(regression, floor) if open_.any() else None


def _added(search: Search, chosen: Choice) -> Fitted | None:
    """Return the set with the effect that explains most beside any form of the others, if one."""
    regression, free = search.regression, search.fitted(_freed(search.regression, chosen))
    best, gained = None, 0.0
    for choice in search.short_list(free):
        number, side = choice.members[-1]
        if regression.hypotheses[number].mechanism.name == UNKNOWN:
            continue
        fit = search.fitted(choice)
        if free.total - fit.total > gained and _solved(search, free, fit) and (
                search.significant(free, fit)):
            best, gained = search.fitted(chosen.plus(number, side)), free.total - fit.total
    return best if best and search.significant(search.fitted(chosen), best) else None


def _solved(search: Search, before: Fitted, after: Fitted) -> bool:
    """Tell whether a set explains what another leaves in each equation in which it does more."""
    first, last = search.excess(before), search.excess(after)
    acts = search.acts(before, after) & (first > 0.0)
    return bool(acts.any() and np.all(last[acts] <= (1.0 - SOLVED) * first[acts]))


def _freed(regression: Regression, chosen: Choice) -> Choice:
    """Return a set with every curve over the variables of its effects, where these act."""
    free = chosen
    for number, one in enumerate(regression.hypotheses):
        if _is_pattern(one) and number not in chosen.numbers and any(
                one.mechanism.variables[0] in _variables(regression.hypotheses[n])
                and acts_in(regression, n)[_equation(regression, one)] for n in chosen.numbers):
            free = free.plus(number, 0)
    return free


def _may_be_freed(regression: Regression, chosen: Choice, equation: int) -> bool:
    """
    Tell whether curves over its variables stand for any form of each effect in an equation.

    They do not for what remembers, nor where orders or frequencies were chosen from many.
    """
    told = {one.mechanism.variables[0] for one in regression.hypotheses
            if _is_pattern(one) and _equation(regression, one) == equation}
    several = [regression.hypotheses[n] for n in chosen.numbers
               if acts_in(regression, n)[equation]]
    return all(told & _variables(one) and not one.mechanism.memory and one.tried == 1
               for one in several)


def _is_pattern(one: Hypothesis) -> bool:
    """Tell whether it is any curve over a variable; of two over one, the coarser."""
    return one.form is not None and 'equation' in one.detail and 'narrowest' not in one.detail


def _equation(regression: Regression, pattern: Hypothesis) -> int:
    """Return the place of the equation that a pattern is of."""
    return regression.equations.index(EQUATIONS.index(pattern.detail['equation']))


def _variables(one: Hypothesis) -> set[str]:
    return {SPEED_OF.get(name, name) for name in one.mechanism.variables}
