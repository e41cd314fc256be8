"""
Sets of plain laws that leave nothing.

A curve may be off its best form, so that a search leaves a tenth of a gap alone. So may a law
whose shape was searched, as the peak of an eddy brake or the time of a spring that fades. A value,
a weight or an eccentricity has no form to be off. Where a few of these bring all equations down to
their noise, they are the answer: by chance no few numbers do that.
"""

from __future__ import annotations

import numpy as np

from ..decisions import ALTERNATIVE, CALIBRATED
from ..mechanisms.hypothesis import BY_RECORDING, Hypothesis, UNKNOWN
from .choice import Fitted
from .search import Explanation, Search, SHORT_LIST

PLAIN = 4  # amplitudes of a law that has no form to be off
MOST = 3  # laws in a set


class Complete(Search):
    """Searches among plain laws for a set that leaves nothing but noise."""

    forms = 3
    turns = 6  # weights fall from those of the whole gap to those of the noise

    def __init__(self, search: Search) -> None:
        regression = search.regression
        super().__init__(regression, np.full(search.sizes.shape, CALIBRATED))
        self._plain = {number for number, one in enumerate(regression.hypotheses) if _plain(one)}

    def candidates(self, near: Fitted) -> list[tuple[bool, float, int, int]]:
        """Return the same of plain laws alone; see :meth:`Search.candidates`."""
        return [one for one in super().candidates(near) if one[2] in self._plain]

    def found(self) -> Fitted | None:
        """Return the set of fewest plain laws that leaves nothing; None where there is none."""
        beam = [self.nothing]
        for _ in range(MOST):
            grown = self._grown(beam)
            whole = [one for one in grown if self.leaves_nothing(one) and self._needed(one)]
            if whole:
                best = min(whole, key=lambda one: one.total)
                return min((one for one in whole if self.alike(one, best)), default=best,
                           key=lambda one: (len(one.columns), one.total))
            beam = grown[:SHORT_LIST]
        return None

    def leaves_nothing(self, fit: Fitted) -> bool:
        """Tell whether a set leaves no more than noise and margin in any equation."""
        return bool(np.all(self.power(fit) <= CALIBRATED))

    def _needed(self, fit: Fitted) -> bool:
        rests = (self.fitted(fit.choice.minus(number)) for number in fit.choice.numbers)
        return all(self.significant(rest, fit) for rest in rests)


def completed(search: Search, explanation: Explanation) -> tuple[Search, Explanation]:
    """Return the explanation by plain laws that leave nothing, where they do with less."""
    chosen = explanation.smallest
    if not chosen.choice.members:
        return search, explanation
    other = Complete(search)
    known = other.fitted(chosen.choice)
    found = other.found()
    if found is None or found.total >= known.total:
        return search, explanation
    alone, more = (len(one.choice.members) for one in (chosen, found))
    whole = (alone == 1 and other.leaves_nothing(known)) or (
        more > alone and not other.off_in(known))
    likelier = known.total - found.total > -np.log(ALTERNATIVE)
    if whole and not (likelier and found.numbers < known.numbers):
        return search, explanation  # nothing is open that other numbers could be for
    for choice in search.choices:  # how the sets known so far fare without a form
        other.fitted(choice)
    return other, Explanation(found, found)


def _plain(one: Hypothesis) -> bool:
    mechanism, curve = one.mechanism, int((one.signs == 1).sum()) > (one.tried == 1)
    return (one.columns.size <= PLAIN and not curve and mechanism.name != UNKNOWN
            and BY_RECORDING not in mechanism.variables)
