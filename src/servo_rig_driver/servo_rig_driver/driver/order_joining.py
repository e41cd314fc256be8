"""
Joins answers that name no request to the requests that they belong to.

Pure logic. A drive that is asked by a frame of its own answers each request once and in order, by
one frame of each kind. An answer that is not there is late, or it is lost: which of the two is
known only once nothing more comes. So samples wait until all requests are answered, which is
usual before the next request. Where that has not been so for a while, no request goes out until
the answers have caught up. Where they have ceased instead, one was lost: nobody can tell which, so
all samples that waited are left out. A drive that is behind is now more behind, now less. Where as
many requests as before are open at each of STEADY in a row, an answer was lost in all likelihood,
and the pause comes then. Where one answer more comes than was asked for, one came twice: again
nobody can tell which, unless a single request was open.
"""

from __future__ import annotations

from typing import Any

from .answer_joining import Sample

STEADY = 16
"""Requests in a row before each of which as many were open, after which an answer was lost; twice
as many after each pause in which the answers caught up."""


class OrderJoiner:
    """
    Collects ``kinds`` answers to each request.

    ``patience`` is for how many ns a request may be open before no other one goes out,
    ``silence`` after how many ns without an answer nothing more comes.
    ``lost`` counts the requests that will never be a sample, ``unasked`` the answers for which
    there was no request.
    """

    def __init__(self, kinds: int, patience: int, silence: int) -> None:
        self.kinds = kinds
        self.patience = patience
        self.silence = silence
        self.lost = 0
        self.unasked = 0
        self._enough = STEADY
        self._full: list[Sample] = []  # answered, and not certain before the next request
        self._begin()

    def _begin(self) -> None:
        self._asked: list[int] = []
        self._came: list[list[Any]] = [[] for _ in range(self.kinds)]
        self._left = self._steady = 0  # requests open before the last one, and for how many so
        self._behind = 0  # ns for which a request has been open
        self._silent: int | None = None  # ns without an answer, where none is asked for

    @property
    def waiting(self) -> int:
        """Number of requests that are not answered in full."""
        return len(self._asked) - min(map(len, self._came))

    def restart(self) -> None:
        """Forget all requests, as when nobody will answer them any more; they count as lost."""
        self.lost += len(self._asked) + len(self._full)
        self._full = []
        self._begin()

    def ask(self, number: int) -> list[Sample]:
        """Note that request ``number`` goes out; return the samples that are certain by then."""
        before, self._left = self._left, self.waiting
        self._steady = self._steady + 1 if 0 < before == self._left else 0
        self._asked.append(number)
        certain, self._full = self._full, []
        return certain

    def withdraw(self, number: int) -> list[Sample]:
        """Note that request ``number`` reached nobody; return the samples that waited for it."""
        if number in self._asked:
            self._asked.remove(number)
            self.lost += 1
        return self._answered()

    def answer(self, kind: int, content: Any, counter: int | None) -> list[Sample]:
        """Take an answer; return the samples that are certain now, in the order of requests."""
        came = self._came[kind]
        if len(came) == len(self._asked):
            self.unasked += 1
            self.lost += len(self._full)
            self._full = []
            return []
        came.append(content)
        if self._silent is not None:
            self._silent = 0
        return self._answered()

    def may_ask(self, elapsed: int) -> bool:
        """
        Return whether a request may go out.

        ``elapsed`` ns were there for answers to come since this was called last.
        """
        if not self._asked:
            return True
        if self._silent is None:
            self._behind += elapsed
            if self._behind <= self.patience and self._steady < self._enough:
                return True
            self._silent = 0
            return False
        self._silent += elapsed
        if self._silent <= self.silence:
            return False
        self._enough = STEADY
        self.restart()
        return True

    def _answered(self) -> list[Sample]:
        """Return the sample where the one open request has all its answers; keep several."""
        if self.waiting or not self._asked:
            return []
        if self._steady >= self._enough:  # it is always behind by so many
            self._enough *= 2
        samples = [(number, answers) for number, *answers in
                   zip(self._asked, *self._came, strict=True)]
        self._begin()
        if len(samples) == 1 and not self._full:
            return samples
        self._full += samples
        return []
