"""
Numbers that stand for what was not measured: -9999, 65535, 1e10.

A few rows hold one and the same number far outside of all others. Taken for a measurement it
moves every equation of the machine.
"""

from __future__ import annotations

import numpy as np

from .finding import Finding

FAR = 10.0
"""Times the range of all other numbers, beyond which a number lies outside."""
FEW = 0.05  # share of the rows
_LEAST = 20  # other numbers, by which the range is known


def fill_value_of(values: np.ndarray, steps: bool = False) -> tuple[float, int] | None:
    """
    Return the number that stands for none, and in how many rows; None where there is none.

    ``steps``: the channel may step, as a current does and an angle does not. Less of it before the
    first step, or after the last, is measured.
    """
    known = values[np.isfinite(values)]
    for end in (np.min, np.max) if len(known) else ():
        held = float(end(known))
        rest = known[known != held]
        count = len(known) - len(rest)
        if len(rest) < _LEAST or count > FEW * len(known):
            continue
        span = float(np.ptp(rest))
        if steps and _at_an_end(known == held) and abs(held) < np.abs(rest).min():
            continue
        if span > 0.0 and float(np.abs(rest - held).min()) > FAR * span:
            return held, count
    return None


def _at_an_end(rows: np.ndarray) -> bool:
    """Tell whether marked rows are the first ones, or the last."""
    count = int(rows.sum())
    return bool(rows[:count].all() or rows[len(rows) - count:].all())


def without(values: np.ndarray, fill: tuple[float, int] | None) -> np.ndarray:
    """Return the numbers that are known and do not stand for none."""
    known = values[np.isfinite(values)]
    return known if fill is None else known[known != fill[0]]


def fill_findings(name: str, fills: dict[str, tuple[float, int]]) -> list[Finding]:
    """Say which columns of a recording hold such numbers."""
    return [Finding('red', f'{name}: {column} is {value:.6g} in {count} row{"s" * (count != 1)} '
                    f'and lies {FAR:g} times further out there than all its other numbers: does '
                    'it stand for what was not measured?',
                    'leave the cell empty in those rows, or cut them')
            for column, (value, count) in fills.items()]
