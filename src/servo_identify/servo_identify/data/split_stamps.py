"""Stamps in two columns, whole seconds and what is beyond them, as messages of ROS have them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
import re

import numpy as np

from .table import Table

_WHOLE = re.compile(r'(?:(.*)[._/ ])??(?:tv_)?(?:sec|secs|seconds)', re.IGNORECASE)
_BEYOND = re.compile(r'(?:(.*)[._/ ])??(?:tv_)?(?:(n|nano)|(u|micro))(?:sec|secs|seconds)',
                     re.IGNORECASE)


def pairs_of(names: Iterable[str]) -> list[tuple[str, str, str, float]]:
    """Return what the stamp is called, its two columns, and the second one's unit in s."""
    whole = {match[1] or '': name for name in names if (match := _WHOLE.fullmatch(name))}
    beyond = {match[1] or '': (name, 1e-9 if match[2] else 1e-6)
              for name in names if (match := _BEYOND.fullmatch(name))}
    return [(stamp or 'timestamp', whole[stamp], *beyond[stamp])
            for stamp in whole if stamp in beyond]


def with_whole_stamps(table: Table) -> Table:
    """
    Return a table with one column, s, for ``stamp.sec`` and ``stamp.nanosec``: ``stamp``.

    Columns whose numbers cannot be these are left as they are.
    """
    for stamp, whole, beyond, unit in pairs_of(list(table.columns)):
        seconds, rest = table.columns[whole], table.columns[beyond]
        fits = np.array_equal(seconds, np.round(seconds)) and bool(
            np.all((rest >= 0.0) & (rest < 1.0 / unit)))
        if stamp in table.columns or not fits:
            continue
        first = int(seconds[0])
        columns = {stamp: seconds - first + rest * unit} | {
            name: column for name, column in table.columns.items() if name not in (whole, beyond)}
        zero = first + table.zeros.get(whole, 0)
        table = replace(table, columns=columns, zeros=table.zeros | {stamp: zero})
    return table
