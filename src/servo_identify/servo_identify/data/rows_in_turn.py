"""Tables whose rows are of several machines in turn, as a bus of servos is logged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .long_form import EACH, MOST_LABELS

OFTEN = 0.25
"""Share of the rows from which on another label means that labels take turns."""
SOON = 3
"""Rounds of all labels within which each of them comes again."""
ALIKE = 0.7
"""Rows of the rarest label, as a share of those of the most frequent one."""
APART = 5.0
"""Times as far as within a label a channel moves over all rows where these are of several."""


class Turns(NamedTuple):
    """The column that tells the machines of a table apart, and what it calls them."""

    label: str
    names: tuple[str, ...]


def check_turns(path: Path, columns: Mapping[str, np.ndarray],
                texts: Mapping[str, Sequence[Any]] | None = None) -> None:
    """Raise ValueError where the rows are of several machines in turn."""
    found = in_turn(columns, texts)
    if found is not None:
        shown = ', '.join(found.names[:4]) + (', ...' if len(found.names) > 4 else '')
        raise ValueError(
            f'{path}: its rows are of several machines in turn, which {found.label!r} tells apart '
            f'({shown}): make a file of each, by pandas: for name, one in '
            f'frame.groupby({found.label!r}): one.to_csv(f"{{name}}.csv"). Rows of one machine '
            'are read without that column')


def in_turn(columns: Mapping[str, np.ndarray],
            texts: Mapping[str, Sequence[Any]] | None = None) -> Turns | None:
    """
    Return what tells rows of several machines apart, which follow in turn; None for one machine.

    Such a column holds few whole numbers, or ``texts``. A channel moves steadily behind each
    label, and jumps to and fro over all rows.
    """
    labels = {name: values for name, values in (texts or {}).items()} | {
        name: column for name, column in columns.items() if _may_label(column)}
    for label, values in labels.items():
        names, of = np.unique([str(one) for one in values] if label in (texts or {}) else values,
                              return_inverse=True)
        if not (1 < len(names) <= MOST_LABELS and len(of) >= EACH * len(names)
                and np.mean(np.diff(of) != 0) > OFTEN):
            continue
        order = np.argsort(of, kind='stable')
        same = np.diff(of[order]) == 0
        # each comes again soon and as often as others, which counts of an encoder do not
        often = np.bincount(of)
        if (often.min() < ALIKE * often.max()
                or np.quantile(np.diff(order)[same], 0.99) > SOON * len(names)):
            continue
        for name, column in columns.items():
            within = np.abs(np.diff(column[order]))[same]
            across = np.nansum(np.abs(np.diff(column)))
            steady = np.nansum(within)
            if name != label and steady > 0.0 and across > APART * steady and np.any(
                    np.diff(column) < 0.0):
                return Turns(label, tuple(str(one).removesuffix('.0') for one in names))
    return None


def _may_label(column: np.ndarray) -> bool:
    """Tell whether a column holds few whole numbers alone."""
    begin = column[:1000]
    return len(np.unique(begin)) <= MOST_LABELS and bool(
        np.isfinite(column).all()) and np.array_equal(column, np.round(column))
