"""Samples on their way to the topics: what one is made of, and how they gather to blocks."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass

COLUMNS = ('motor_position', 'load_position', 'torque', 'external_torque', 'current', 'voltage',
           'current_reference', 'reference_velocity', 'reference_position', 'temperature')
"""Values of one sample in this order, in rad, N m, A, V, rad/s and degC; NaN: not measured."""


@dataclass(frozen=True)
class SampleBlock:
    """
    Consecutive samples.

    ``stamp`` is the instant of the first one in ns, ``period`` in s; ``columns`` maps the names of
    COLUMNS to arrays of shape (samples,).
    """

    sequence: int
    stamp: int
    period: float
    columns: dict[str, array]


class BlockBuilder:
    """
    Gathers samples to blocks of one size and hands each full one to ``out``.

    Sample k was taken at ``origin + k * period`` exactly, ns. All blocks are full: when a sample
    is missing, those before it that do not fill a block are given up, and counted in ``dropped``.
    """

    def __init__(self, size: int, origin: int, period: int,
                 out: Callable[[SampleBlock], None]) -> None:
        self.size = size
        self.origin = origin
        self.period = period
        self.out = out
        self.dropped = 0
        self._first = 0
        self._rows: list[Sequence[float]] = []

    def add(self, number: int, row: Sequence[float]) -> None:
        """Take sample ``number``, its values in the order of COLUMNS."""
        rows = self._rows
        if rows and number != self._first + len(rows):
            self.dropped += len(rows)
            rows.clear()
        if not rows:
            self._first = number
        rows.append(row)
        if len(rows) == self.size:
            columns = {name: array('d', values)
                       for name, values in zip(COLUMNS, zip(*rows, strict=True), strict=True)}
            rows.clear()
            self.out(SampleBlock(self._first, self.origin + self._first * self.period,
                                 self.period * 1e-9, columns))
