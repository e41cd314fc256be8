"""What the change detector says of a change."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Alarm:
    """
    A change: of which balance, in which of its features, by how many deviations, seen when.

    ``since`` is the running number of the first sample of the window that told, ``sequence`` that
    of its end.
    """

    balance: str
    feature: str
    deviations: float
    since: int
    sequence: int

    @property
    def seen(self) -> str:
        """What was seen, for people."""
        return f'{self.feature} by {self.deviations:.1f} deviations since sample {self.since}'

    def __str__(self) -> str:
        return f'balance {self.balance} changed: {self.seen}'
