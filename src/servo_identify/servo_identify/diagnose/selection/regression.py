"""
The regression of all residuals on nuisances and mechanisms, from sums of products by block.

Residuals and columns are kept as sums of products, block by block and equation by equation.
Every fit, held-out error and bootstrap draws on these sums alone.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import dataclass, field

import numpy as np

from ..mechanisms.hypothesis import Columns, Hypothesis
from ..residuals.nuisance import Nuisance
from ..residuals.samples import ResidualSamples
from .bounded_least_squares import bounded

FOLDS = 8


@dataclass(frozen=True)
class Sums:
    """
    Weighted sums of products over all equations, for some columns.

    ``whole`` (columns, columns) of all blocks, ``power`` (equations, columns) the sum of squares
    of each column in each equation; ``parts`` by equation: which columns move it, (p,), and their
    share of ``whole``, (p, p).
    """

    whole: np.ndarray
    power: np.ndarray
    parts: list[tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Products:
    """
    The products of a few columns, block by block: what one fit needs.

    ``parts`` by equation: the places of the columns that move it among the columns asked for, and
    their products (blocks, n, n). ``family`` and ``fold`` (blocks,) say what each block is of.
    """

    parts: list[tuple[np.ndarray, np.ndarray]]
    family: np.ndarray
    fold: np.ndarray
    size: int

    def sums(self, weight: np.ndarray) -> Sums:
        """Return the sums with each group weighed, ``weight`` (equations, families)."""
        return _summed([(good, _taken(weight[i, self.family][None], part)[0])
                        for i, (good, part) in enumerate(self.parts)], self.size)

    def folds(self, weight: np.ndarray) -> np.ndarray:
        """Return the weighted sums by fold, (FOLDS, columns, columns)."""
        inside = np.arange(FOLDS)[:, None] == self.fold
        folds = np.zeros((FOLDS, self.size, self.size))
        for i, (good, part) in enumerate(self.parts):
            folds[:, good[:, None], good] += _taken(inside * weight[i, self.family], part)
        return folds

    def drawn(self, times: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """Return the weighted sums with each block taken ``times`` (blocks,)."""
        total = np.zeros((self.size, self.size))
        for i, (good, part) in enumerate(self.parts):
            total[np.ix_(good, good)] += np.tensordot(times * weight[i, self.family], part, axes=1)
        return total

    def errors(self, values: np.ndarray) -> np.ndarray:
        """Return squared errors by equation and block; ``values`` ([blocks,] columns), first 1."""
        form = 'bij,i,j->b' if values.ndim == 1 else 'bij,bi,bj->b'
        several = [np.einsum(form, part, values[..., good], values[..., good])
                   for good, part in self.parts]
        return np.maximum(np.array(several), 0.0)  # less is rounding, where a fit leaves nothing


@dataclass
class Regression:
    """
    Sums of products of residual, nuisances and hypotheses.

    Column 0 is the residual; then come the nuisances, then the columns of each hypothesis
    (``members``). A group is one equation in one family of excitation. ``products[e]`` has shape
    (blocks, p_e, p_e) over the columns ``inside[e]`` that move equation e, ``by_family[e]`` their
    sums over the blocks of each family.
    """

    samples: ResidualSamples
    nuisance: Nuisance
    hypotheses: list[Hypothesis]
    members: list[np.ndarray] = field(init=False)
    inside: list[np.ndarray] = field(init=False)
    products: list[np.ndarray] = field(init=False)

    def __post_init__(self) -> None:
        samples = self.samples
        self.equations = [int(e) for e in np.unique(samples.equation)]
        families = [one.measured.recording.family or one.measured.recording.name
                    for one in samples.errors]
        self.families = sorted(set(families))
        self.blocks = int(samples.block.max()) + 1 if len(samples.block) else 0
        of_recording = np.array([self.families.index(f) for f in families])
        self.family = np.zeros(self.blocks, dtype=int)
        self.family[samples.block] = of_recording[samples.recording]
        self.recording = np.zeros(self.blocks, dtype=int)
        self.recording[samples.block] = samples.recording
        self.fold = np.arange(self.blocks) % FOLDS
        self.counts = np.array([np.bincount(samples.block[samples.equation == e],
                                            minlength=self.blocks) for e in self.equations])
        size = 1 + self.nuisance.columns.shape[1]
        self.members = []
        for one in self.hypotheses:
            self.members.append(np.arange(size, size + one.columns.size))
            size += one.columns.size
        self.size = size
        self.values = np.array([label.partition(':')[0] for label in self.nuisance.labels], str)
        self.low = np.concatenate(([0.0], self.nuisance.low))
        self.high = np.concatenate(([0.0], self.nuisance.high))
        self.room = np.full(size, np.inf)  # half the tolerance that the servo file gives
        told = 1 + np.flatnonzero([label in samples.servo.values
                                   for label in self.nuisance.labels])
        self.room[told] = 0.5 * (self.high[told] - self.low[told])
        self._sum_up()

    def _sum_up(self) -> None:
        samples = self.samples
        tables = [Columns(samples.base[:, None]), Columns(self.nuisance.columns),
                  *(one.columns for one in self.hypotheses)]
        firsts = np.cumsum([0, *(table.size for table in tables[:-1])])
        self.inside, self.products, self.where = [], [], []
        for e in self.equations:
            rows = np.flatnonzero(samples.equation == e)
            rows = rows[np.argsort(samples.block[rows], kind='stable')]
            used, several = [], []
            for table, first in zip(tables, firsts, strict=True):
                some = table.at(rows)
                moved = np.flatnonzero(some.any(axis=0) | (first == 0))
                used.append(first + moved)
                several.append(some[:, moved])
            kept, part = np.concatenate(used), np.hstack(several)
            del several
            edges = np.searchsorted(samples.block[rows], np.arange(self.blocks + 1))
            products = np.zeros((self.blocks, len(kept), len(kept)))
            for b in range(self.blocks):
                some = part[edges[b]:edges[b + 1]]
                products[b] = some.T @ some
            where = np.full(self.size, -1)
            where[kept] = np.arange(len(kept))
            self.inside.append(kept)
            self.products.append(products)
            self.where.append(where)
        self.by_family = self._family_sums()

    def narrowed(self, kept: np.ndarray, numbers: Collection[int]) -> Regression:
        """Return the regression of some of the blocks on some of the hypotheses, by number."""
        part, chosen = copy(self), sorted(numbers)
        columns = np.concatenate([np.arange(1 + self.nuisance.columns.shape[1]),
                                  *(self.members[n] for n in chosen)]).astype(int)
        part.hypotheses = [self.hypotheses[n] for n in chosen]
        sizes = np.cumsum([1 + self.nuisance.columns.shape[1],
                           *(len(self.members[n]) for n in chosen)])
        part.members = [np.arange(a, b) for a, b in zip(sizes[:-1], sizes[1:], strict=True)]
        part.size, part.room = len(columns), self.room[columns]
        part.products, part.where, part.inside = [], [], []
        for products, where in zip(self.products, self.where, strict=True):
            at = where[columns]
            good = np.flatnonzero(at >= 0)
            part.products.append(products[np.ix_(kept, at[good], at[good])])
            part.inside.append(good)
            part.where.append(np.full(len(columns), -1))
            part.where[-1][good] = np.arange(len(good))
        part.family, part.recording = self.family[kept], self.recording[kept]
        part.counts, part.blocks = self.counts[:, kept], len(kept)
        part.fold = np.arange(part.blocks) % FOLDS
        part.by_family = part._family_sums()
        return part

    def nuisances(self, chosen: Sequence[int]) -> np.ndarray:
        """Return the nuisance columns beside some hypotheses: a value that is freed is none."""
        freed = [self.hypotheses[c].path for c in chosen if self.hypotheses[c].path]
        if not freed:
            return np.arange(1, 1 + len(self.values))
        return 1 + np.flatnonzero(~np.isin(self.values, freed))

    def _family_sums(self) -> list[np.ndarray]:
        """Return the products of each equation summed by family, (families, p, p)."""
        inside = np.arange(len(self.families))[:, None] == self.family
        return [np.tensordot(inside.astype(float), one, axes=1) for one in self.products]

    def of(self, columns: np.ndarray) -> Products:
        """Return the products of a few columns."""
        parts = []
        for products, where in zip(self.products, self.where, strict=True):
            at = where[columns]
            good = np.flatnonzero(at >= 0)
            parts.append((good, products[:, at[good][:, None], at[good]]))
        return Products(parts, self.family, self.fold, len(columns))

    def sums(self, weight: np.ndarray) -> Sums:
        """Return the sums over all columns, each group weighed: (equations, families)."""
        return _summed([(self.inside[i], self.table(i, weight[i]))
                        for i in range(len(self.products))], self.size)

    def table(self, equation: int, weight: np.ndarray) -> np.ndarray:
        """Return the sums of one equation (by its place), each family weighed: (p, p)."""
        return np.tensordot(weight, self.by_family[equation], axes=1)

    def scores_of(self, columns: np.ndarray, values: np.ndarray,
                  wanted: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """Return the weighted products of wanted columns with what is left, (blocks, wanted)."""
        answer = np.zeros((self.blocks, len(wanted)))
        for i, products in enumerate(self.products):
            at, of = self.where[i][columns], self.where[i][wanted]
            good, mine = at >= 0, np.flatnonzero(of >= 0)
            if not len(mine):
                continue
            part = products[:, of[mine][:, None], at[good]] @ values[good]
            answer[:, mine] += part * weight[i, self.family][:, None]
        return answer


def _summed(parts: list[tuple[np.ndarray, np.ndarray]], size: int) -> Sums:
    """Return the sums over all equations of those of each."""
    whole, power = np.zeros((size, size)), np.zeros((len(parts), size))
    for i, (at, table) in enumerate(parts):
        whole[at[:, None], at] += table
        power[i, at] = np.diag(table)
    return Sums(whole, power, parts)


def _taken(weight: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Return sums over blocks, (sums, n, n), of products (blocks, n, n) by ``weight``."""
    return np.dot(weight, part.reshape(len(part), -1)).reshape(len(weight), *part.shape[1:])


def solve(gram: np.ndarray, low: np.ndarray, high: np.ndarray,
          prior: np.ndarray | float = 0.0) -> np.ndarray:
    """
    Return the amplitudes of a fit: ``gram`` of the residual (first) and the columns.

    ``prior`` is added to the squares of the columns.
    """
    inner = np.array(gram[1:, 1:])
    inner[np.diag_indices_from(inner)] += prior
    return bounded(inner, np.ascontiguousarray(gram[1:, 0]), low, high)
