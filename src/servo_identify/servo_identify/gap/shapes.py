"""What the shapes of a candidate (widths, time constants, places) may be, and their search."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize_scalar

from .candidates import Candidate
from .scales import is_place, PLACES, Scales
from .side_by_side import side_by_side
from .stack import Beside, Stack

if TYPE_CHECKING:
    from .screening import Screening

BEYOND = 0.3  # share of the travel by which a place may lie outside it
REACH = 1.2  # of a shape's logarithm, to either side of where it was tried
NARROW = 0.1  # the same of a frequency: a resonance beside it does not show
SIZED = 10  # times that the columns of a law are taken anew where it fits
SETTLED = 0.02  # share by which what it leaves may change then
END = 1.1  # times the smallest that can be found, up to which a shape is at that end
LARGER = 2.0  # times the largest shape tried first, up to which it is searched


class Shapes:
    """Within what the shapes of candidates may lie."""

    def __init__(self, stack: Stack, candidates: list[Candidate]) -> None:
        self.stack = stack
        self.tried: dict[str, set[float]] = {}
        for candidate in candidates:
            for path, value in candidate.shapes:
                self.tried.setdefault(path, set()).add(value)

    def is_place(self, path: str) -> bool:
        """Tell whether a shape of the extended servo says where: then it may be negative."""
        return is_place(self.stack.extended.declaration(path))

    def around(self, path: str, value: float) -> tuple[float, float]:
        """Bounds of the line on which a shape is searched: of its logarithm, unless a place."""
        if self.is_place(path):  # not farther than to the next one: many are alike far off
            low, high = Scales(self.stack.balances).travelled()
            beyond, apart = BEYOND * (high - low), max(np.diff(PLACES)) * (high - low)
            return max(low - beyond, value - apart), min(high + beyond, value + apart)
        low, high = self.within(path)
        middle = float(np.clip(np.log(value), np.log(low), np.log(high)))
        reach = NARROW if self.stack.extended.declaration(path).unit == 'Hz' else REACH
        return max(middle - reach, np.log(low)), min(middle + reach, np.log(high))

    def within(self, path: str) -> tuple[float, float]:
        """Bounds of a shape: not far beyond what the recordings reach, where it would not show."""
        low, high = self.stack.extended.declaration(path).bounds
        tried = self.tried.get(path, ())
        if tried:
            high = min(high, LARGER * max(tried))
        return max(low, 1e-12), high

    def at_an_end(self, path: str, value: float) -> bool:
        """Tell whether a shape is beyond all that were tried, or as small as can be found."""
        tried = self.tried.get(path, ())
        if self.is_place(path) or not self.searched(path) or not tried:
            return False
        return not END * np.exp(-REACH) * min(tried) < value < max(tried)

    def searched(self, path: str) -> bool:
        """Tell whether a shape is searched on a line; orders are read off the residual."""
        parameter = self.stack.extended.declaration(path)
        return bool(parameter.grid) and parameter.name != 'order'


def refined(screening: Screening, one: int, chosen: list[int], closely: bool = False) -> int:
    """
    Return the number of a version of a candidate at the size and shape that fit best.

    Its columns are taken anew at the fitted amplitudes, so that a law with kinks counts at the
    size it has; each shape is searched on a line, to a few percent when ``closely``.
    """
    found = _sought(screening, one, chosen, closely)
    return one if found is None else screening.add(*found)


def all_refined(screening: Screening, several: list[int], chosen: list[int]) -> list[int]:
    """Return what :func:`refined` says of each of several candidates, sought side by side."""
    sought = list(side_by_side(lambda one: _sought(screening, one, chosen, False), several))
    return [one if found is None else screening.add(*found)
            for one, found in zip(several, sought, strict=True)]


def _sought(screening: Screening, one: int, chosen: list[int],
            closely: bool) -> tuple[Candidate, np.ndarray, np.ndarray] | None:
    """Return (version, columns, amplitudes) of a candidate where it fits best; None: as it is."""
    library, shapes = screening.library, screening.shapes
    version, table, size = library.candidates[one], screening.table(one), library.amplitudes[one]
    start = least = screening.loss([*chosen, one])
    for _ in range(3 if closely else 1):
        before = least
        loss, trial, size, beside = _sized(screening, chosen, version, table, size, least)
        if loss < least:
            least, table = loss, trial
        for i, (path, value) in enumerate(version.shapes):
            if not shapes.searched(path):
                continue
            line = _Line(screening, chosen, version, i, size, beside, not shapes.is_place(path))
            around = shapes.around(path, value)
            found = minimize_scalar(line.loss, bounds=around, method='bounded',
                                    options={'maxiter': 14 if closely else 6,
                                             'xatol': 0.01 * (around[1] - around[0])})
            if found.fun < least:
                least = line.loss(found.x)
                version, table = line.version, line.table
        if least >= before * (1.0 - 1e-4):
            break
    return (version, table, size) if least < start else None


def _sized(screening: Screening, chosen: list[int], version: Candidate, table: np.ndarray,
           size: np.ndarray, last: float) -> tuple[float, np.ndarray, np.ndarray, Beside | None]:
    """
    Return (loss, columns, amplitudes, what is fitted beside them) of a version where it fits.

    Taken anew until the loss, ``last`` with the columns given, changes little: how wide a gap is
    hangs on how stiff the mesh is that closes.
    """
    best = None
    for _ in range(SIZED):
        size, beside = screening.fitted(chosen, version, table, size)
        table = screening.stack.columns(version, size, beside)
        loss = screening.loss_with(chosen, version, table)
        if best is None or loss < best[0]:
            best = loss, table, size, beside
        if abs(loss - last) <= SETTLED * loss:
            break
        last = loss
    return best


@dataclass
class _Line:
    """One shape of a candidate, moved on a line; remembers what it tried last."""

    screening: Screening
    chosen: list[int]
    start: Candidate
    shape: int
    size: np.ndarray
    beside: Beside | None
    logarithmic: bool
    version: Candidate | None = None
    table: np.ndarray | None = None

    def loss(self, at: float) -> float:
        """Return the cross-validated sum of squares with the shape there."""
        shapes = list(self.start.shapes)
        value = float(np.exp(at) if self.logarithmic else at)
        shapes[self.shape] = (shapes[self.shape][0], value)
        self.version = replace(self.start, shapes=tuple(shapes))
        self.table = self.screening.stack.columns(self.version, self.size, self.beside)
        return self.screening.loss_with(self.chosen, self.version, self.table)
