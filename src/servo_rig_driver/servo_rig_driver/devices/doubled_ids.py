"""
Whether two nodes of a bus have one id: each request is then answered twice.

A single node that was held up, as on a busy machine, answers several requests at once, and so
twice within the time of one. What it answers promptly, after a silence, is to the one request.
"""

from __future__ import annotations

from collections.abc import Callable, Set

ECHO = 20_000_000
"""Within which the second of two nodes with one id answers what the first has answered, ns."""

QUIET = 1_000_000_000
"""Without an answer, before one request is made to count its answers, ns."""

RESTLESS = 3 * QUIET
"""After which a node that does not fall silent is taken to speak unasked, ns."""

PROMPT = QUIET // 10
"""Within which a node has answered that request, or the count proves nothing, and the other one
after it, ns."""

PROOFS = 3
_TRIES = 10  # for each proof, on a machine where answers are late


def doubled(suspects: Set[int], count: Callable[[], tuple[Set[int], int]],
            wanted: Callable[[], bool]) -> set[int]:
    """
    Return the suspects that have answered twice in each of PROOFS counts that prove something.

    ``count`` makes one request after QUIET, and returns who answered it twice and how long the
    answers took, ns.
    """
    left = set(suspects)
    for _ in range(PROOFS):
        for _ in range(_TRIES):
            twice, took = count()
            if took <= PROMPT or not wanted():
                break
        left &= twice
        if took > PROMPT or not left:
            return set()
    return left
