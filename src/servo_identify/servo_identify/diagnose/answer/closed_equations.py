"""How much of what the equations are off by an explanation takes."""

from __future__ import annotations

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS

from ..decisions import SOLVED
from .evidence import Evidence


def acting(evidence: Evidence) -> set[str]:
    """Return the equations in which what was found takes a worthwhile part."""
    search = evidence.found.search
    best = evidence.found.explanation.smallest
    if not best.choice.members:
        return set()
    before, after = search.excess(search.nothing), search.excess(best)
    return {EQUATIONS[e] for i, e in enumerate(search.regression.equations)
            if before[i] - after[i] > 0.1 * before[i] and before[i] > 0.0}


def closed(evidence: Evidence, balance: str) -> float:
    """Return the share of what an equation was off by, above its noise, that is gone."""
    search = evidence.found.search
    for at, one in enumerate(search.regression.equations):
        if EQUATIONS[one] == balance:
            before, after = (float(search.excess(fit)[at]) for fit in (
                search.nothing, evidence.found.explanation.smallest))
            return 1.0 - after / before if before > 0.0 else 0.0
    return 0.0


def closed_all(evidence: Evidence) -> bool:
    """Tell whether no equation is certainly off still, or each by a small part of what it was."""
    search, best = evidence.found.search, evidence.found.explanation.smallest
    before, after = search.excess(search.nothing), search.excess(best)
    quiet = search.power(best) <= search.open_from
    return bool(np.all(quiet | (after <= (1.0 - SOLVED) * before)))
