"""The stretch of a recording that a person wants: from one instant of it to another."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isfinite
from typing import NamedTuple

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
        if not begin < end:
            until = f'to {self.end:g} s' if isfinite(self.end) else 'on'
            raise ValueError(f'{one.name}: from {self.begin:g} s {until} there is nothing; it '
                             f'goes from 0 to {one.duration:.6g} s')
        name = f'{one.name}[{begin * one.period:.6g}-{end * one.period:.6g} s]'
        first, end = one.sequence + begin, one.sequence + end
        if isinstance(one, Recording):
            return replace(one.part(first, end), name=name)
        one.cut(first, end)
        one.rename(name)
        return one


ALL = Stretch()
"""All of a recording."""
