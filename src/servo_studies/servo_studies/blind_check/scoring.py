"""
The figures of the blind check: what the table of standards asks, of any set of outcomes.

The same figures are taken of the diagnosis and of the baselines, whose answers are made outcomes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from scipy.stats import norm

from .case_outcome import Named, Outcome
from .cases import Case

NOTHING, UNKNOWN, FAILED = '(nothing)', '(unknown)', '(failed)'


@dataclass(frozen=True)
class Figure:
    """
    One figure: ``value`` of ``of`` cases (NaN where there is none) and what was asked of it.

    ``low`` and ``high`` bound a share at 90 % (Wilson); ``goal`` is a text, ``met`` None where the
    figure is only reported or has no case.
    """

    kind: str
    name: str
    value: float
    of: int
    goal: str = ''
    met: bool | None = None
    low: float = float('nan')
    high: float = float('nan')
    share: bool = True


def figures(outcomes: Sequence[Outcome]) -> list[Figure]:
    """Return all figures of the table of standards, in its order."""
    null = _of(outcomes, 'null')
    single = _of(outcomes, 'single')
    seen = [o for o in single if o.case.multiple >= 1.0]
    unknown = _of(outcomes, 'removed', 'foreign')
    found = [share_of('nothing withheld', 'false attributions', null, lambda o: bool(o.named),
                      'at most 2 %', most=0.02),
             share_of('nothing withheld', 'says unknown where nothing is', null,
                      lambda o: not o.named and o.says_unknown)]
    for multiple in sorted({o.case.multiple for o in single}):
        part = [o for o in single if o.case.multiple == multiple]
        found.append(share_of('one effect', f'first choice right at {multiple:g}x', part,
                              lambda o: o.first_right))
    sizes = [o.named[0].size for o in seen if o.named]
    found += [
        share_of('one effect', 'first choice right, from 1x up', seen, lambda o: o.first_right,
                 'at least 90 %', least=0.90),
        share_of('one effect', 'truth in the ambiguity set, of those that name something',
                 [o for o in seen if o.named], lambda o: o.in_set, 'at least 97 %', least=0.97),
        _mean('one effect', 'mean size of the ambiguity set', sizes, 'at most 2', most=2.0),
        share_of('one effect', 'balance located', seen, lambda o: o.located, 'at least 97 %',
                 least=0.97),
        share_of('one effect', 'something wrong named beside or instead', seen,
                 lambda o: bool(o.false)),
        share_of('unknown cause', 'says unknown', unknown, lambda o: o.says_unknown,
                 'at least 90 %', least=0.90),
        share_of('unknown cause', 'names a wrong cause', unknown, lambda o: bool(o.named),
                 'at most 10 %', most=0.10),
        share_of('unknown cause', 'of those named, flagged', [o for o in unknown if o.named],
                 lambda o: o.says_unknown, 'all', least=1.0),
        share_of('two effects', 'exact set', _of(outcomes, 'pair'), lambda o: o.exact, '80 %',
                 least=0.80),
        share_of('three effects', 'exact set', _of(outcomes, 'triple'), lambda o: o.exact),
    ]
    pairs = [o for o in outcomes if o.resolved]
    return [*found, *_of_shrink(outcomes),
            share_of('ambiguous pairs', 'resolved by the proposed recording', pairs,
                     lambda o: o.resolved['by_proposed'], 'at least 80 %', least=0.80),
            share_of('ambiguous pairs', 'the same where a recording is proposed at all',
                     [o for o in pairs if o.resolved['proposed']],
                     lambda o: o.resolved['by_proposed']),
            share_of('ambiguous pairs', 'by the recording, or the value to be measured', pairs,
                     lambda o: o.resolved['by_proposed'] or o.resolved['by_value']),
            share_of('ambiguous pairs', 'resolved by a random one', pairs,
                     lambda o: o.resolved['by_random'], 'at most 40 %', most=0.40)]


def _of_shrink(outcomes: Sequence[Outcome]) -> list[Figure]:
    pairs = shrinks(outcomes)
    if len(pairs) < 3:
        slope = float('nan')
    else:
        predicted, realised = np.array([(p, r) for p, r, _ in pairs]).T
        slope = float(predicted @ realised / (predicted @ predicted))
    met = abs(slope - 1.0) <= 0.1 if slope == slope else None
    covered = [interval[0] <= p <= interval[1] for p, _, interval in pairs if interval]
    share = float(np.mean(covered)) if covered else float('nan')
    low, high = _wilson(share, len(covered))
    return [Figure('all', 'slope of realised over predicted shrink', slope, len(pairs),
                   '1 within 0.1', met, share=False),
            Figure('all', '90 % intervals of the realised shrink that hold the predicted', share,
                   len(covered), '85 to 95 %', 0.85 <= share <= 0.95 if covered else None, low,
                   high)]


def shrinks(outcomes: Iterable[Outcome]
            ) -> list[tuple[float, float, tuple[float, float] | None]]:
    """Return predicted and realised shrink and interval of every cause that has them."""
    return [(n.predicted, n.realised, n.interval) for o in outcomes for n in o.named
            if n.predicted is not None and n.realised is not None]


def share_of(kind: str, name: str, outcomes: Sequence[Outcome], good: Callable[[Outcome], bool],
             goal: str = '', least: float | None = None, most: float | None = None) -> Figure:
    """Return which share of outcomes is so, and whether that meets its goal."""
    n = len(outcomes)
    if not n:
        return Figure(kind, name, float('nan'), 0, goal)
    value = sum(map(good, outcomes)) / n
    met = None
    if least is not None or most is not None:
        met = (least is None or value >= least) and (most is None or value <= most)
    return Figure(kind, name, value, n, goal, met, *_wilson(value, n))


def confusion(outcomes: Iterable[Outcome]) -> tuple[list[str], list[str], np.ndarray]:
    """Return what is true (rows), what was named first (columns), and how often, from 1x up."""
    counts: Counter[tuple[str, str]] = Counter()
    for one in outcomes:
        if len(one.case.truths) > 1 or 0.0 < one.case.multiple < 1.0:
            continue
        truth = one.case.faults[0] if one.case.truths else None
        row = truth.name if truth else NOTHING
        if one.case.kind == 'removed':
            row += ' (removed)'
        if one.status == 'failed':
            column = FAILED
        elif not one.named:
            column = UNKNOWN if one.says_unknown else NOTHING
        elif truth and one.named[0].is_(truth):
            column = truth.name
        else:
            column = one.named[0].effect
        counts[row, column] += 1
    rows = sorted({row for row, _ in counts})
    columns = sorted({column for _, column in counts})
    table = np.array([[counts[r, c] for c in columns] for r in rows], int)
    return rows, columns, table.reshape(len(rows), len(columns))


def risk_coverage(outcomes: Iterable[Outcome]) -> tuple[np.ndarray, np.ndarray]:
    """
    Return coverage and risk as the confidence asked for falls, both (n,).

    Coverage is the share of all cases in which a cause is named with at least that confidence
    (its predicted shrink), risk the share of wrong first choices among them.
    """
    known = list(outcomes)
    named = sorted((o for o in known if o.named), key=lambda o: -o.confidence)
    wrong = np.cumsum([not o.first_right or o.case.kind in ('removed', 'foreign') for o in named])
    counted = np.arange(1, len(named) + 1)
    return counted / max(len(known), 1), wrong / counted if len(named) else wrong.astype(float)


def of_baseline(case: Case, answer: dict[str, Any]) -> Outcome:
    """Return the answer of a baseline as an outcome; a baseline says neither where nor unknown."""
    named = tuple(Named(row['effect'], row['site']) for row in answer['named'])
    return Outcome(case, 'explained' if named else 'no_gap', named, '',
                   confidence=answer['shrink'])


def _of(outcomes: Iterable[Outcome], *kinds: str) -> list[Outcome]:
    return [o for o in outcomes if o.case.kind in kinds]


def _mean(kind: str, name: str, values: Sequence[float], goal: str, most: float) -> Figure:
    if not values:
        return Figure(kind, name, float('nan'), 0, goal, share=False)
    mean = float(np.mean(values))
    return Figure(kind, name, mean, len(values), goal, mean <= most, share=False)


def _wilson(share: float, n: int) -> tuple[float, float]:
    """Bounds of a share at 90 % (Wilson 1927)."""
    if not n or share != share:
        return float('nan'), float('nan')
    z = norm.ppf(0.95)
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z * sqrt(share * (1 - share) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    return max(0.0, middle - half), min(1.0, middle + half)
