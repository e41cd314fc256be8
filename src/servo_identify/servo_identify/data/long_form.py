"""Tables that hold their channels below each other, as databases of time series export them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

MOST_LABELS = 64
EACH = 10  # rows of a label at least, in the mean


def check_wide(path: Path, columns: Mapping[str, np.ndarray],
               texts: Mapping[str, Sequence[Any]]) -> None:
    """
    Raise ValueError where one column has the numbers of all channels and another one their names.

    Then a time rises behind each name, but not over all rows; all else is constant behind a name.
    """
    for label, values in texts.items():
        names, of = np.unique([str(one) for one in values], return_inverse=True)
        if not (1 < len(names) <= MOST_LABELS and len(values) >= EACH * len(names)):
            continue
        numbers = {name: column for name, column in columns.items()
                   if np.isfinite(column).all() and not _all(column, of, 0.0)}
        times = [name for name, column in numbers.items()
                 if _all(column, of) and not np.all(np.diff(column) > 0.0)]
        rest = [name for name in numbers if name not in times]
        if times and len(rest) == 1:
            shown = ', '.join(names[:4]) + (', ...' if len(names) > 4 else '')
            raise ValueError(
                f'{path}: holds its channels below each other: the numbers stand in {rest[0]!r} '
                f'and their names in {label!r} ({shown}). Give each a column of its own, by '
                f'pandas: pivot_table(index={times[0]!r}, columns={label!r}, '
                f'values={rest[0]!r}).to_csv(NEW)')


def _all(column: np.ndarray, of: np.ndarray, step: float | None = None) -> bool:
    """Tell whether numbers rise behind each label, or all have this ``step``."""
    steps = (np.diff(column[of == k]) for k in range(int(of.max()) + 1))
    return all(bool(np.all(one > 0.0 if step is None else one == step)) for one in steps)
