"""The stretch of a recording that a person wants: from one instant of it to another."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isfinite
from typing import NamedTuple

import numpy as np

from servo_twin.recording.recording import Recording

from .long_bags import Long


class Stretch(NamedTuple):
    """From ``begin`` to before ``end``, s after the first sample of a recording."""

    begin: float = 0.0
    end: float = inf

    def of(self, one: Long) -> Long:
        """
        Return the stretch of a recording, whose name tells from when to when it goes.

        Raises ValueError where it is empty.
        """
        if self == ALL:
            return one
        begin, end = (max(0, min(len(one), round(at / one.period))) if isfinite(at) else len(one)
                      for at in self)
        self._judge(begin < end, one.name, one.duration)
        name = self.named(one.name, begin * one.period, end * one.period)
        first, end = one.sequence + begin, one.sequence + end
        if isinstance(one, Recording):
            return replace(one.part(first, end), name=name)
        one.cut(first, end)
        one.rename(name)
        return one

    def rows(self, name: str, time: np.ndarray) -> tuple[int, int]:
        """
        Return the first row, and that behind the last one, of rising times, s, of a table.

        Raises ValueError, with the name of the table, where there is none.
        """
        if self == ALL:
            return 0, len(time)
        step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        since = time - time[0] + 0.5 * step
        first, end = np.searchsorted(since, self).tolist()
        self._judge(first < end, name, time[-1] - time[0] + step)
        return first, end

    def named(self, name: str, begin: float, end: float) -> str:
        """Return what is called which goes from ``begin`` to ``end``, s, of a recording."""
        return name if self == ALL else f'{name}[{begin:.6g}-{end:.6g} s]'

    def _judge(self, there: bool, name: str, duration: float) -> None:
        if not there:
            until = f'to {self.end:g} s' if isfinite(self.end) else 'on'
            raise ValueError(f'{name}: from {self.begin:g} s {until} there is nothing; it goes '
                             f'from 0 to {duration:.6g} s')


ALL = Stretch()
"""All of a recording."""


def instant(value: float) -> float:
    """Return an instant, s after the first sample; raises ValueError for what cannot be one."""
    if not 0.0 <= value < inf:
        raise ValueError(f'{value:g} is no instant of a recording: give 0 s or more')
    return value
