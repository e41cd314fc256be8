"""A recording more beside those that are there, without computing theirs again."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .balance import Balance
from .candidates import Candidate, Extended
from .library import Library
from .screening import Screening
from .stack import Beside, Stack


def joined(screening: Screening, more: Stack, candidates: list[int]) -> Screening:
    """Return a screening of further recordings beside the known ones, of some candidates."""
    library = screening.library
    chosen = [library.candidates[c] for c in candidates]
    sizes = [library.amplitudes[c] for c in candidates]
    tables = [np.vstack((screening.table(c), more.columns(candidate, size)))
              for c, candidate, size in zip(candidates, chosen, sizes, strict=True)]
    return Screening(Joined(screening, more), Library(chosen, tables, sizes))


@dataclass
class Joined:
    """
    The rows of a screening with those of further recordings below them; stands for a Stack.

    What may move within tolerance is the same in all, a zero or a gain of one recording its own.
    """

    known: Screening
    more: Stack
    extended: Extended = field(init=False)
    balances: list[Balance] = field(init=False)
    base: np.ndarray = field(init=False)
    block: np.ndarray = field(init=False)
    balance: np.ndarray = field(init=False)
    recording: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        first, more = self.known.stack, self.more
        self.extended = first.extended
        self.balances = [*first.balances, *more.balances]
        self.base = np.concatenate((first.base, more.base))
        self.block = np.concatenate((first.block, more.block + first.block.max() + 1))
        self.balance = np.concatenate((first.balance, more.balance))
        self.recording = np.concatenate((first.recording, more.recording + len(first.balances)))

    def nuisances(self) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
        """Return (names, columns, low, high) as Stack.nuisances does."""
        known, size = self.known, len(self.known.nuisance)
        labels, low, high = list(known.labels), list(known.low[:size]), list(known.high[:size])
        upper = known.columns(known.nuisance)
        names, columns, least, most = self.more.nuisances()
        lower = np.zeros((len(self.more.base), size))
        fresh = []
        for name, column, bottom, top in zip(names, columns.T, least, most, strict=True):
            path, _, number = name.rpartition(':')
            if number.isdigit():
                name = f'{path}:{int(number) + len(known.stack.balances)}'
            if name in labels:
                lower[:, labels.index(name)] = column
                continue
            labels.append(name)
            low.append(bottom)
            high.append(top)
            fresh.append(column)
        beside = np.column_stack(fresh) if fresh else np.zeros((len(lower), 0))
        table = np.block([[upper, np.zeros((len(upper), beside.shape[1]))], [lower, beside]])
        return labels, table, np.array(low), np.array(high)

    def columns(self, candidate: Candidate, amplitudes: np.ndarray,
                beside: Beside | None = None) -> np.ndarray:
        """Return what `Stack.columns` does, of all recordings."""
        upper = lower = None
        if beside is not None:
            upper, lower = (replace(beside, residual=part) for part in np.split(
                beside.residual, [len(self.known.stack.base)]))
        return np.vstack((self.known.stack.columns(candidate, amplitudes, upper),
                          self.more.columns(candidate, amplitudes, lower)))
