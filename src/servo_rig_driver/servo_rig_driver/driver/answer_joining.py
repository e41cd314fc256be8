"""
Joins the answers of several nodes to one SYNC into one sample.

Pure logic. An answer is what one node sends after one SYNC. Which SYNC that was is told by the
counter that SYNC carries (CiA 301, object 1019h) where the nodes echo it: frames may then be late
by any time, or lost, and no sample is ever made of two instants. Nodes that do not echo it are
taken to answer the last SYNC before, which holds as long as they answer within a period. Drives
that are asked by frames of their own are joined by order_joining.py.
"""

from __future__ import annotations

from collections import deque
from typing import Any

from ..devices.pdo_table import sync_counter, SYNC_COUNTS

Sample = tuple[int, list[Any]]
"""The number of a SYNC, and the answers to it by kind."""


class SampleJoiner:
    """
    Collects ``kinds`` answers to each SYNC, one a node.

    ``lost`` counts the samples that were asked for and will never be complete, ``unasked`` the
    answers for which there was no SYNC.
    """

    def __init__(self, kinds: int) -> None:
        self.kinds = kinds
        self.lost = 0
        self.unasked = 0
        self._open: deque[list[Any]] = deque()
        self._next = [0] * kinds
        self._closed = 0

    @property
    def waiting(self) -> int:
        """Number of SYNCs that are not answered in full."""
        return len(self._open)

    def restart(self) -> None:
        """Forget all SYNCs, as when nobody will answer them any more; they count as lost."""
        self.lost += len(self._open)
        self._open.clear()
        self._next = [0] * self.kinds
        self._closed = 0

    def ask(self, number: int) -> list[Sample]:
        """Note that SYNC ``number`` goes out, numbers rise; return no sample."""
        self._open.append([number, self.kinds, *[None] * self.kinds])
        return []

    def may_ask(self, elapsed: int) -> bool:
        """Return that a SYNC may go out at any time."""
        return True

    def withdraw(self, number: int) -> list[Sample]:
        """Note that SYNC ``number`` reached nobody; it is lost once a later one is answered."""
        return []

    def answer(self, kind: int, content: Any, counter: int | None) -> list[Sample]:
        """
        Take an answer; return the sample that it completes, if any.

        ``counter`` is what the node echoed, None where it echoes nothing. Samples come in the
        order of their numbers: one that completes closes all before it.
        """
        row = self._uncounted(kind) if counter is None else self._counted(kind, counter)
        if row is None:
            self.unasked += 1
            return []
        row[2 + kind] = content
        row[1] -= 1
        if row[1]:
            return []
        while self._open[0] is not row:
            self._open.popleft()
            self._closed += 1
            self.lost += 1
        self._open.popleft()
        self._closed += 1
        return [(row[0], row[2:])]

    def _uncounted(self, kind: int) -> list[Any] | None:
        row = self._open[-1] if self._open else None
        return None if row is None or row[2 + kind] is not None else row

    def _counted(self, kind: int, counter: int) -> list[Any] | None:
        first = max(0, self._next[kind] - self._closed)
        for place in range(first, len(self._open)):
            row = self._open[place]
            if sync_counter(row[0]) == counter:
                self._next[kind] = self._closed + place + 1
                return row
            if place - first >= SYNC_COUNTS:
                return None
        return None
