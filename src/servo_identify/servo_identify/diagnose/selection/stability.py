"""
Does the choice depend on the split? The search again on halves of the recordings.

What comes and goes with the split is no finding (stability selection: Meinshausen, Buehlmann
2010).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..mechanisms.hypothesis import Mechanism, UNKNOWN
from .complete import completed
from .confidence import by_values
from .explain import Explained
from .search import Search
from .small_effects import with_small_effects

PAIRS = 2  # of complementary halves

Half = Mapping[tuple[str, ...], Mechanism]
"""The mechanisms that half of the recordings gives, by their keys."""


def halves(found: Explained) -> list[Half]:
    """
    Return the mechanisms that each half of the recordings (or blocks) gives.

    Each half chooses among the hypotheses that the search on all of them looked at closely.
    """
    regression, chance = found.search.regression, np.random.default_rng(0)
    tried = found.search.tried
    number = len(np.unique(regression.recording))
    answers: list[Half] = []
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
            answers.append({one.mechanism.key: one.mechanism for one in best.chosen})
    return answers


def share_of(answers: Sequence[Half], *names: Mechanism) -> float:
    """Return the share of the halves in which one of some mechanisms came out; 1 without any."""
    keys = {name.key for name in names}
    return _share(bool(keys & answer.keys()) for answer in answers)


def share_in_place(answers: Sequence[Half], names: Sequence[Mechanism],
                   others: Collection[Mechanism]) -> float:
    """
    Return the share of the halves in which something acts in the place of a mechanism.

    Its own name or a rival's (``names``, its own first), or another at the same site that depends
    on the same; ``others`` are told beside it and stand for themselves.
    """
    keys, told, own = {name.key for name in names}, {name.key for name in others}, names[0]
    return _share(any(key in keys or key not in told and one.site == own.site
                      and set(one.variables) & set(own.variables) for key, one in answer.items())
                  for answer in answers)


def _share(answers: Iterable[bool]) -> float:
    """Return the share of the answers that are yes; 1.0 without any."""
    several = list(answers)
    return sum(several) / len(several) if several else 1.0


def instead(answers: Sequence[Half], names: Sequence[Mechanism], others: Collection[Mechanism]
            ) -> list[tuple[Mechanism, float]]:
    """
    Return what halves give in the place of a mechanism, and the share of all of them that does.

    ``names`` are those of the mechanism, its own first; ``others`` what is told beside it. Its
    place is its site, or any where a half has nothing at that site.
    """
    keys, told = {name.key for name in names}, {name.key for name in others}
    found: Counter[Mechanism] = Counter()
    for answer in answers:
        if not keys & answer.keys():
            free = [one for key, one in answer.items() if key not in told and one.name != UNKNOWN]
            found.update([one for one in free if one.site == names[0].site] or free)
    return [(one, count / len(answers)) for one, count in found.most_common()]
