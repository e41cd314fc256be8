"""The count of an encoder, from its readings alone."""

from __future__ import annotations

import numpy as np

ALIKE = 0.01  # share of a count by which a step may miss a multiple of it
MULTIPLES = 0.9  # share of the steps that are multiples of a count
SMALLEST = 1e-3  # of the largest step, above which one is no matter of rounded digits
ROUNDED = 4.0  # digits by which second differences of a rounded reading may be off


def count_of(x: np.ndarray) -> float:
    """
    Return the count of a reading, in its unit; 0 where it is not in counts.

    It is the smallest step of which nearly all are multiples. A table rounds counts to decimals,
    or to digits that are fewer for large numbers: steps that this leaves lie far below the count.
    """
    x = x[np.isfinite(x)]
    steps = np.abs(np.diff(x, 2))
    steps = np.sort(steps[steps > 1e-9 * np.abs(x).max(initial=0.0)])
    ends = np.flatnonzero(steps[1:] > 4.0 * ROUNDED * steps[:-1]) + 1
    for first in ends[::-1]:
        count = _least(steps, first, ROUNDED * steps[first - 1])
        if count:
            return count
    return _commonest(steps) or _least(steps, 0, 0.0)


def _least(steps: np.ndarray, first: int, off: float) -> float:
    """
    Return the least of sorted steps from the ``first`` on, where nearly all are multiples of it.

    They may miss one by ``off``, or where that is zero by a share; 0 where they do not.
    """
    rest = steps[first:]
    if len(rest) < 16:
        return 0.0
    count = float(np.percentile(rest, 1))
    count = float(rest[rest < 1.5 * count].mean())
    return count if np.mean(_missed(steps, count) <= (off or ALIKE * count)) > MULTIPLES else 0.0


def _missed(steps: np.ndarray, count: float) -> np.ndarray:
    return np.abs(steps - count * np.round(steps / count))


def _commonest(steps: np.ndarray) -> float:
    """
    Return the commonest of sorted steps where nearly all are multiples of it, else 0.

    It is the count of a reading of which some rows were made up, with steps of any size.
    """
    large = steps[steps > SMALLEST * steps.max(initial=0.0)]
    if len(large) < 16:
        return 0.0
    place = np.round(np.log(large) / ALIKE).astype(int)
    number, times = np.unique(place, return_counts=True)
    count = float(np.median(large[place == number[np.argmax(times)]]))
    whole = _missed(steps, count) <= ALIKE * count
    if np.mean(whole) <= MULTIPLES:
        return 0.0
    some = steps[whole & (steps > 0.5 * count)]
    return float(np.median(some / np.round(some / count)))
