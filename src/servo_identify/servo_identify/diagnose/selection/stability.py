"""
Does the choice depend on the split? The search again on halves of the recordings.

What comes and goes with the split is no finding (stability selection: Meinshausen, Buehlmann
2010).
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from ..mechanisms.hypothesis import UNKNOWN
from .explain import Explained
from .search import Search

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
            best = Search(half).explain().smallest
            answers.append({half.hypotheses[n].mechanism.key for n in best.choice.numbers})
    return answers


def shares(found: Explained, answers: list[set[tuple[str, ...]]]) -> dict[tuple[str, ...], float]:
    """Return how often each mechanism came out of the halves, named ones only."""
    counted = Counter(key for answer in answers for key in answer if key[0] != UNKNOWN)
    return {key: count / max(1, len(answers)) for key, count in counted.items()}
