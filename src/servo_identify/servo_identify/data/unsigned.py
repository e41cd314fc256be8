"""
Signed registers of a drive that were read as unsigned numbers: -1 stands as 65535.

An angle of that kind is a counter that wraps around (:mod:`.survey`), and a time never falls.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .signals import ANGLES

OTHERS = ('t', *ANGLES)
"""Columns that are not looked at here."""
BITS = (16, 32)  # of the registers of drives; 8 bit are too few to tell


def bits_of(values: np.ndarray) -> int:
    """
    Return of how many bits signed numbers are that were read as unsigned, 0 for none.

    They are whole, lie near both ends of the range, and nothing is in the half between.
    """
    known = values[np.isfinite(values)]
    if len(known) < 2 or known.min() < 0.0 or (known != np.round(known)).any():
        return 0
    for bits in BITS:
        quarter, high = 2.0**(bits - 2), known >= 2.0**(bits - 1)
        if known.max() < 2.0**bits and high.any() and not high.all() and not np.any(
                (known >= quarter) & (known < 3.0 * quarter)):
            return bits
    return 0


def check_signed(path: Path, name: str, source: str, values: np.ndarray) -> None:
    """Raise ValueError for numbers (rows,) of a column whose negative ones are unsigned."""
    bits = 0 if name in OTHERS else bits_of(values)
    if bits:
        known = values[np.isfinite(values)]
        low, high = known[known < 2.0**(bits - 1)], known[known >= 2.0**(bits - 1)]
        raise ValueError(
            f'{path}: {source!r} ({name}) holds whole numbers up to {low.max():.0f} and from '
            f'{high.min():.0f} to {high.max():.0f}, none between: negative numbers of {bits} bit '
            f'that were read as unsigned. Say so in a mapping file: {name}: {{source: {source!r}, '
            f'{steps_of(bits)}}}')


def steps_of(bits: int) -> str:
    """Return the steps of a mapping file that turn unsigned numbers into signed ones."""
    return f'above: {2**(bits - 1) - 1}, subtract: {2**bits}'
