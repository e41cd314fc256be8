"""Columns that say which of several runs a row is of."""

from __future__ import annotations

from collections.abc import Collection, Sequence
import re
from typing import Any

import numpy as np

WORDS = 'episode|rollout|trajectory|traj|trial|demo|run|take|repetition'
COLUMN = re.compile(rf'({WORDS})(?:_?(?:index|id|no|nr|number|idx))?', re.IGNORECASE)
"""How such a column is called; the first group is the word for a run."""


def numbered(name: str, labels: Sequence[Any]) -> np.ndarray | None:
    """Return the numbers of runs that texts tell apart, from 1 on; None of another column."""
    if COLUMN.fullmatch(name) is None or any(one is None for one in labels):
        return None
    known = {label: k for k, label in enumerate(dict.fromkeys(labels), 1)}
    return np.array([known[one] for one in labels], dtype=float)


def may_hold_runs(names: Collection[str]) -> bool:
    """Tell whether one of the columns may tell runs apart."""
    return any(COLUMN.fullmatch(name) for name in names)
