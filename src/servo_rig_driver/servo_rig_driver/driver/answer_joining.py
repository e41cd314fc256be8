"""
Joins the answers of several nodes to one SYNC into one sample.

Pure logic. An answer is what one node sends after one SYNC. Which SYNC that was is told by the
counter that SYNC carries (CiA 301, object 1019h) where the nodes echo it: frames may then be late
by any time, or lost, and no sample is ever made of two instants. Nodes that do not echo it are
taken to answer the last SYNC before, which holds as long as they answer within a period. Drives
that are asked by frames of their own are joined by order_joining.py.

The counter begins again after SYNC_COUNTS. Where several SYNCs of one count are open, answers that
come again may be late ones to the first of them, or those to the last where all between were lost,
as on a cable that was pulled. Late ones catch up; where they do not, whole rounds were lost.
Samples are kept back until that is known. Numbers may be left out: not every one is asked for.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from itertools import islice
from math import inf
from operator import itemgetter
from typing import Any

from ..devices.pdo_table import sync_counter, SYNC_COUNTS

Sample = tuple[int, list[Any]]
"""The number of a SYNC, and the answers to it by kind."""
PROVES = SYNC_COUNTS // 2
"""SYNCs within which answers that are late, and not those of another round, catch up somewhat."""
NEAR = SYNC_COUNTS // 12
"""SYNCs by which a drive may be behind beside whole rounds."""


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
        self._next = [0] * kinds  # the least number that each node may answer next
        self._kept: list[Sample] = []  # of a round that is not known yet
        self._latest: list[int] = []  # the last SYNC of its count as each of them came
        self._since = self._were = 0

    @property
    def waiting(self) -> int:
        """Number of SYNCs that are not answered in full."""
        return len(self._open)

    def restart(self) -> None:
        """Forget all SYNCs, as when nobody will answer them any more; they count as lost."""
        self.lost += len(self._open) + len(self._kept)
        self._open.clear()
        self._kept, self._latest = [], []
        self._next = [0] * self.kinds

    def ask(self, number: int) -> list[Sample]:
        """Note that SYNC ``number`` goes out, numbers rise; return the samples sure by now."""
        proved = self._proved()
        self._open.append([number, self.kinds, *[None] * self.kinds])
        return proved

    def _proved(self) -> list[Sample]:
        """Return what is kept, once it is known to which SYNCs it belongs."""
        if not self._kept:
            return []
        self._since += 1
        if self._since < PROVES:
            return []
        late = self._open[-1][0] - self._latest[-1] if self._open else 0
        if self._were - len(self._open) > 3 or late > NEAR:
            self._since, self._were = 0, len(self._open)
            return []
        return self._moved_on()

    def _moved_on(self) -> list[Sample]:
        """Return what is kept as answers to the last SYNCs of their counts; others are lost."""
        by = self._latest[-1] - self._kept[-1][0]
        told = {row[0] + by: row[1:] for row in self._open}
        self._next = [number + by for number in self._next]
        while self._open and self._open[0][0] <= self._latest[-1]:
            self._open.popleft()
            self.lost += 1
        for row in self._open:
            row[1:] = told.get(row[0], [self.kinds, *[None] * self.kinds])
        return self._settled(self._latest)

    def _settled(self, numbers: list[int]) -> list[Sample]:
        """Return what is kept as answers to SYNCs of these numbers."""
        kept, self._kept, self._latest = self._kept, [], []
        return [(number, answers) for number, (_, answers) in zip(numbers, kept, strict=True)]

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
        last = row[0] if counter is None else self._last_like(row[0])
        proved = []
        if last == row[0] and self._kept:
            caught_up = row[0] <= self._latest[-1]
            proved = self._settled([number for number, _ in self._kept] if caught_up
                                   else self._latest)
        while self._open[0] is not row:
            self._open.popleft()
            self.lost += 1
        self._open.popleft()
        if last == row[0]:
            return [*proved, (row[0], row[2:])]
        if not self._kept:
            self._since, self._were = 0, len(self._open)
        self._keep((row[0], row[2:]), last)
        return []

    def _keep(self, sample: Sample, last: int) -> None:
        """Keep a sample; those before it are of SYNCs before its ``last`` one."""
        below = last
        for k in reversed(range(len(self._kept))):
            if self._latest[k] < below:
                break
            self._latest[k] = below = self._last_like(self._kept[k][0], below)
        self._kept.append(sample)
        self._latest.append(last)

    def _last_like(self, number: int, below: float = inf) -> int:
        """Return the last SYNC of the count of one that is open, below a number; else that one."""
        count = sync_counter(number)
        return next((row[0] for row in reversed(self._open)
                     if row[0] < below and sync_counter(row[0]) == count), number)

    def _uncounted(self, kind: int) -> list[Any] | None:
        row = self._open[-1] if self._open else None
        return None if row is None or row[2 + kind] is not None else row

    def _counted(self, kind: int, counter: int) -> list[Any] | None:
        first = bisect_left(self._open, self._next[kind], key=itemgetter(0))
        for row in islice(self._open, first, None):
            if sync_counter(row[0]) == counter:
                self._next[kind] = row[0] + 1
                return row
        return None
