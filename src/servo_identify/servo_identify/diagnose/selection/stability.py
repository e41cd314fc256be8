"""
Does the choice depend on the split? The search again on halves of the recordings.

What comes and goes with the split is no finding (stability selection: Meinshausen, Buehlmann
2010).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..mechanisms.hypothesis import Mechanism
from .complete import completed
from .confidence import by_values
from .explain import Explained
from .search import Search
from .small_effects import with_small_effects

PAIRS = 2  # of complementary halves


def halves(found: Explained) -> list[set[tuple[str, ...]]]:
    """
    Return the keys of the mechanisms that each half of the recordings (or blocks) gives.

    Each half chooses among the hypotheses that the search on all of them looked at closely.
    """
    regression, chance = found.search.regression, np.random.default_rng(0)
    tried = found.search.tried
    number = len(np.unique(regression.recording))
    answers = []
    for _ in range(PAIRS):
        if number >= 4:
            first = chance.permutation(number) < number // 2
            inside = first[regression.recording]
        else:  # too few recordings to leave half of them out: stretches of them
            stretch = np.arange(regression.blocks) // max(1, regression.blocks // 8)
            inside = (chance.permutation(stretch.max() + 1) % 2 == 0)[stretch]
        for part in (inside, ~inside):
            kept = np.flatnonzero(part)
            if len(kept) < 8:
                continue
            half = regression.narrowed(kept, tried)
            search = Search(half)
            search, explanation = completed(*with_small_effects(search, search.explain()))
            best = by_values(replace(found, hypotheses=half.hypotheses, search=search,
                                     explanation=explanation))
            answers.append({one.mechanism.key for one in best.chosen})
    return answers


def share_of(answers: list[set[tuple[str, ...]]], *names: Mechanism) -> float:
    """Return the share of the halves in which one of some mechanisms came out; 1 without any."""
    keys = {name.key for name in names}
    return sum(bool(keys & answer) for answer in answers) / len(answers) if answers else 1.0
