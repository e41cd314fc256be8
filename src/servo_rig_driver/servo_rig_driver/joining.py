"""
Joins the answers of several nodes to one SYNC into one sample.

Pure logic. TPDOs carry no number, so the SYNC that an answer belongs to has to be inferred:

``order``
    The n-th answer of a kind belongs to the n-th SYNC. True on a bus that loses no frame (the
    Unix-socket and the virtual bus), however late an answer comes.
``last``
    An answer belongs to the last SYNC that went out before it came. True where every node answers
    within a period (hardware), also when a frame is lost.
"""

from __future__ import annotations

from collections import deque
from typing import Any

RULES = ('order', 'last')
Sample = tuple[int, list[Any]]
"""The number of a SYNC, and the answers to it by kind."""


class SampleJoiner:
    """
    Collects ``kinds`` answers to each SYNC.

    ``lost`` counts the samples that were asked for and will never be complete, ``unasked`` the
    answers for which there was no SYNC. Raises ValueError for an unknown rule.
    """

    def __init__(self, kinds: int, rule: str) -> None:
        if rule not in RULES:
            raise ValueError(f"join = '{rule}' is unknown; it is one of {list(RULES)}")
        self.kinds = kinds
        self.by_order = rule == 'order'
        self.lost = 0
        self.unasked = 0
        self.in_doubt = False
        self._open: deque[list[Any]] = deque()
        self._held: list[Sample] = []
        self._answered = [0] * kinds
        self._closed = 0

    @property
    def waiting(self) -> int:
        """Number of SYNCs that are not answered in full."""
        return len(self._open)

    def restart(self) -> None:
        """Forget all SYNCs, as when nobody will answer them any more; they count as lost."""
        self.lost += len(self._open) + len(self._held)
        self._open.clear()
        self._held.clear()
        self._answered = [0] * self.kinds
        self._closed = 0
        self.in_doubt = False

    def doubt(self) -> None:
        """
        Hold samples back from now on, after a frame that may have been an answer, or too many.

        They are released once every SYNC is answered, which shows that nothing was shifted; when
        that does not come about, restart().
        """
        self.in_doubt = self.by_order

    def ask(self, number: int) -> None:
        """Note that SYNC ``number`` went out."""
        self._open.append([number, self.kinds, *[None] * self.kinds])

    def answer(self, kind: int, content: Any) -> list[Sample]:
        """Take an answer; return the samples that it completes, in their order, mostly none."""
        row = self._row(kind)
        if row is None or row[2 + kind] is not None:
            self.unasked += 1
            return []
        row[2 + kind] = content
        row[1] -= 1
        if row[1]:
            return []
        while self._open[0] is not row:
            self._open.popleft()
            self.lost += 1
        self._open.popleft()
        self._closed += 1
        sample = row[0], row[2:]
        if not self.in_doubt:
            return [sample]
        self._held.append(sample)
        if self._open:
            return []
        self.in_doubt = False
        released, self._held = self._held, []
        return released

    def _row(self, kind: int) -> list[Any] | None:
        if not self.by_order:
            return self._open[-1] if self._open else None
        place = self._answered[kind] - self._closed
        if not 0 <= place < len(self._open):
            return None
        self._answered[kind] += 1
        return self._open[place]
