"""
What recordings cannot tell apart: values that may change together while nothing simulated does.

Torque constant, inertias and friction by one factor are such a case where no torque is measured.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

UNSURE = 0.5
"""A number whose standard error exceeds this share of its scale is not identified."""

PART = 0.2
"""A number belongs to a change that is not seen if it has this share of it."""

LITTLE = 0.02
"""A share of a combination that is left out of the sentence about it."""


def still(hessian: np.ndarray, count: int) -> np.ndarray:
    """
    Return the mask (p,) of numbers that recordings do not move at all, which a fit should hold.

    ``hessian`` (p, p) in units of the scales, whose first ``count`` rows are values, the others
    delays and zeros.
    """
    size = np.sqrt(np.maximum(np.diag(hessian), 0.0))
    found: np.ndarray = size * UNSURE < 1.0
    found[count:] = size[count:] < 1e-12
    return found


def unseen(hessian: np.ndarray, held: np.ndarray, count: int) -> np.ndarray:
    """
    Return the changes of values that recordings do not show, (count, d) orthonormal columns.

    ``hessian`` and ``count`` as in :func:`still`, ``held`` (p,) its answer. Delays and zeros are
    free to follow. A change is not seen where its standard error exceeds :data:`UNSURE` scales;
    the scale of a value that has a tolerance is at most the width of that.
    """
    value, other = np.flatnonzero(~held[:count]), count + np.flatnonzero(~held[count:])
    across = hessian[np.ix_(value, other)]
    known = hessian[np.ix_(value, value)] - across @ np.linalg.pinv(
        hessian[np.ix_(other, other)], hermitian=True) @ across.T
    sizes, changes = np.linalg.eigh(known)
    changes = changes[:, sizes * UNSURE**2 < 1.0]
    found = np.zeros((count, changes.shape[1]))
    found[value] = changes
    return found


def alike(changes: np.ndarray, size: np.ndarray, share: np.ndarray, names: Sequence[str]
          ) -> list[str]:
    """
    Say which values cannot be told apart, and which combinations of them can.

    ``changes`` (n, d) of :func:`unseen`; ``size`` (n,) what a change of one value by its scale
    shows; ``share`` (n,) that scale in shares of the value.
    """
    if not changes.shape[1]:
        return []
    shown, _ = np.linalg.qr(size[:, None] * changes)  # by what shows, beside by what moves
    joined = np.maximum(np.abs(changes @ changes.T), np.abs(shown @ shown.T)) > PART**2
    left, said = set(np.flatnonzero(np.diag(joined))), []
    while left:
        group, found = set(), {min(left)}
        while found != group:
            group = found
            found = {i for i in left if joined[i, list(group)].any()} | group
        left -= group
        members = np.array(sorted(group))
        factors = _combinations(changes[members] * share[members, None])
        factors[np.abs(factors) < LITTLE] = 0.0
        alone = np.count_nonzero(factors, axis=1) == 1  # such a value is known by itself
        unknown = ~factors[alone].any(axis=0)
        said.append(_said([names[i] for i in members[unknown]], factors[~alone][:, unknown]))
    return said


def _combinations(changes: np.ndarray) -> np.ndarray:
    """Return factors (k, members) of the sums that no change (members, d) moves."""
    left, sizes, _ = np.linalg.svd(changes)
    rows = left[:, np.count_nonzero(sizes > 1e-3 * sizes[0]):].T.copy()
    for k in range(len(rows)):  # as few members in each as can be
        pivot = int(np.argmax(np.abs(rows[k])))
        rows[k] /= rows[k, pivot]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, pivot], rows[k])
    return rows / np.take_along_axis(rows, np.abs(rows).argmax(axis=1)[:, None], axis=1)


def _said(paths: Sequence[str], combinations: np.ndarray) -> str:
    if len(paths) == 1:
        return (f'{paths[0]} is not determined: these recordings do not show a change of it '
                'beside all else that is free. It stays as given')
    names = [path.rpartition('.')[2] for path in paths]
    names = names if len(set(names)) == len(names) else list(paths)
    sums = '; '.join(_sum(row, names) for row in combinations)
    told = {0: 'nothing of them', 1: 'one combination of their changes in %: '}.get(
        len(combinations), f'{len(combinations)} combinations of their changes in %: ')
    return (f'{", ".join(paths[:-1])} and {paths[-1]} cannot be told apart. These recordings tell '
            f'{told}{sums}. The fit takes the values that are nearest to the given ones. Measure '
            'one by itself and leave it out of what is free')


def _sum(factors: np.ndarray, names: Sequence[str]) -> str:
    terms = [f'{"-" if factor < 0.0 else "+"} {f"{size:.2f} " if size < 0.995 else ""}{name}'
             for factor, name in zip(factors, names, strict=True) if (size := abs(factor))]
    return ' '.join(terms).removeprefix('+ ')
