"""How much of what the equations are off by an explanation takes."""

from __future__ import annotations

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS

from ..decisions import SOLVED, WORTH
from .evidence import Evidence


def acting(evidence: Evidence) -> set[str]:
    """Return the equations in which what was found takes a worthwhile part."""
    before, after = _off(evidence)
    shown = before - after > WORTH * before
    return {EQUATIONS[e] for e, acts in zip(
        evidence.found.search.regression.equations, shown, strict=True) if acts}


def closed(evidence: Evidence, balance: str) -> float:
    """Return the share of what an equation was off by, above its noise, that is gone."""
    before, after = _off(evidence)
    mine = [EQUATIONS[e] == balance for e in evidence.found.search.regression.equations]
    first, last = float(before[mine].sum()), float(after[mine].sum())
    return 1.0 - last / first if first > 0.0 else 0.0


def closed_all(evidence: Evidence) -> bool:
    """Tell whether no equation is certainly off still, or each by a small part of what it was."""
    return not still_off(evidence)


def still_off(evidence: Evidence) -> list[str]:
    """Return the equations that are certainly off still, by no small part of what they were."""
    search = evidence.found.search
    before, after = _off(evidence)
    off = search.power(evidence.found.explanation.smallest) > search.open_from
    return [EQUATIONS[e] for e, one in zip(
        search.regression.equations, off & (after > (1.0 - SOLVED) * before), strict=True) if one]


def _off(evidence: Evidence) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much each equation is off above its noise, before and after."""
    search = evidence.found.search
    return search.excess(search.nothing), search.excess(evidence.found.explanation.smallest)
