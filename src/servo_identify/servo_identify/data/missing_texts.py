"""Texts that stand in a column of numbers where none was measured: OL, #DIV/0!, ERR, inf."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
import re
from typing import Any

import numpy as np

from .number_texts import is_hexadecimal, plain

SHOWN = 3  # texts that a warning names
_NEVER_A_NUMBER = re.compile(r'[-+]?1[.,]#[A-Z]+0*|#[A-Z]+/?\d?[!?]?|\D*[^\W\d_]{2,}.*|\D+',
                             re.IGNORECASE)
"""1.#INF of C, #DIV/0! of a spreadsheet, what begins with a word, and what has no digit."""


def without_missing(name: str, values: Sequence[Any]) -> tuple[Sequence[Any], str]:
    """
    Return cells with None in place of texts that can be no number, and what is said of them.

    A column of no more numbers than such texts stays as it is, and so does one that may be
    hexadecimal or holds its own name again. A cell with a digit in front, such as 12 V, is no such
    text.
    """
    cells = [one.strip() if isinstance(one, str) else '' for one in values]
    other = {cell for cell in set(cells) if cell and _is_text(cell)}
    rows = [k for k, cell in enumerate(cells) if cell in other]
    known = sum(cell not in ('', None) for cell in values) - len(rows)
    if not other or known <= len(rows) or name in other or is_hexadecimal(cells):
        return values, ''
    left = list(values)
    for k in rows:
        left[k] = None
    counts = Counter(cells[k] for k in rows)
    told = ', '.join(f'{text!r} in {count} row{"s" * (count != 1)}'
                     for text, count in counts.most_common(SHOWN))
    more = f', {len(counts) - SHOWN} other texts' if len(counts) > SHOWN else ''
    return left, (f'column {name!r} has {told}{more}, the first is row {rows[0] + 1}: no number '
                  'stands there, they are NaN')


def without_infinite(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return columns with NaN in place of infinite numbers, but for the time ``t``."""
    return {name: np.where(np.isinf(column), np.nan, column)
            if name != 't' and np.isinf(column).any() else column
            for name, column in columns.items()}


def _is_text(cell: str) -> bool:
    """Tell whether a cell can be no number, however it is written."""
    if not _NEVER_A_NUMBER.fullmatch(cell):
        return False
    try:
        float(plain(cell))
    except ValueError:
        return True
    return False
