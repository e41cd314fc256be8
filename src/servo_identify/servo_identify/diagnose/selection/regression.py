"""
The regression of all residuals on nuisances and mechanisms, from sums of products by block.

Residuals and columns are kept as sums of products, block by block and equation by equation.
Every fit, held-out error and bootstrap draws on these sums alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field

import numpy as np

from ..mechanisms.hypothesis import Hypothesis
from ..residuals.nuisance import Nuisance
from ..residuals.samples import ResidualSamples
from .bounded_least_squares import bounded

FOLDS = 8


@dataclass
class Regression:
    """
    Sums of products of residual, nuisances and hypotheses.

    Column 0 is the residual; then come the nuisances, then the columns of each hypothesis
    (``members``). A group is one equation in one family of excitation. ``products[e]`` has shape
    (blocks, p_e, p_e) over the columns ``inside[e]`` that move equation e.
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
        self.low = np.concatenate(([0.0], self.nuisance.low))
        self.high = np.concatenate(([0.0], self.nuisance.high))
        self._sum_up()

    def _sum_up(self) -> None:
        samples = self.samples
        tables = [samples.base[:, None], self.nuisance.columns,
                  *(one.columns.table for one in self.hypotheses)]
        self.inside, self.products, self.where = [], [], []
        for e in self.equations:
            rows = np.flatnonzero(samples.equation == e)
            rows = rows[np.argsort(samples.block[rows], kind='stable')]
            part = np.hstack([table[rows] for table in tables])
            used = np.flatnonzero(np.abs(part).max(axis=0, initial=0.0) > 0.0)
            used = np.union1d([0], used)
            part = np.ascontiguousarray(part[:, used])
            edges = np.searchsorted(samples.block[rows], np.arange(self.blocks + 1))
            products = np.zeros((self.blocks, len(used), len(used)))
            for b in range(self.blocks):
                some = part[edges[b]:edges[b + 1]]
                products[b] = some.T @ some
            where = np.full(self.size, -1)
            where[used] = np.arange(len(used))
            self.inside.append(used)
            self.products.append(products)
            self.where.append(where)

    def of_blocks(self, kept: np.ndarray) -> Regression:
        """Return the regression of some of the blocks, by their numbers."""
        part = copy(self)
        part.products = [products[kept] for products in self.products]
        part.family, part.recording = self.family[kept], self.recording[kept]
        part.counts, part.blocks = self.counts[:, kept], len(kept)
        part.fold = np.arange(part.blocks) % FOLDS
        return part

    def nuisances(self, chosen: Sequence[int]) -> np.ndarray:
        """Return the nuisance columns beside some hypotheses: a value that is freed is none."""
        freed = {self.hypotheses[c].path for c in chosen if self.hypotheses[c].path}
        return np.array([1 + i for i, label in enumerate(self.nuisance.labels)
                         if label.partition(':')[0] not in freed], dtype=int)

    def fold_sums(self, weight: np.ndarray) -> list[np.ndarray]:
        """Return by equation the weighted sums by fold, (folds, p_e, p_e)."""
        answer = []
        for i, products in enumerate(self.products):
            scaled = weight[i, self.family]
            answer.append(np.array([np.einsum('b,bij->ij', scaled[self.fold == k],
                                              products[self.fold == k]) for k in range(FOLDS)]))
        return answer

    def assembled(self, sums: Sequence[np.ndarray], columns: np.ndarray) -> np.ndarray:
        """Return the products of some columns, summed over the equations."""
        total = np.zeros((len(columns), len(columns)))
        for i, table in enumerate(sums):
            at = self.where[i][columns]
            good = np.flatnonzero(at >= 0)
            inner = at[good]
            total[np.ix_(good, good)] += table[np.ix_(inner, inner)]
        return total

    def errors_of(self, columns: np.ndarray, values: np.ndarray,
                  blocks: np.ndarray | None = None) -> np.ndarray:
        """
        Return the squared error by equation and block, (equations, blocks).

        ``values`` (columns,), that of column 0 being 1.
        """
        blocks = np.arange(self.blocks) if blocks is None else blocks
        answer = np.zeros((len(self.equations), len(blocks)))
        for i, products in enumerate(self.products):
            at = self.where[i][columns]
            good = at >= 0
            inner, b = at[good], values[good]
            part = products[np.ix_(blocks, inner, inner)] if len(blocks) < self.blocks else (
                products[:, inner[:, None], inner])
            answer[i] = np.einsum('bij,i,j->b', part, b, b)
        return answer

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


def solve(gram: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the amplitudes of a fit: ``gram`` of the residual (first) and the columns."""
    return bounded(gram[1:, 1:], gram[1:, 0], low, high)
