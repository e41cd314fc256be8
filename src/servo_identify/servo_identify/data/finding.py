"""What a check of recordings found, as a sentence and what to do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

LEVELS = ('red', 'amber', 'green')


@dataclass(frozen=True)
class Finding:
    """
    One thing that was found.

    ``level`` is one of :data:`LEVELS`: red where an answer would be wrong, amber where it would
    be less than it could be, green where all is well. ``action`` says what to do, '' for green.
    ``recording`` is the name of the one that it is about, '' where it is about all.
    """

    level: str
    sentence: str
    action: str = ''
    recording: str = ''


def refusal(red: Sequence[Finding]) -> str:
    """Return the sentence with which a command refuses data: all that is red, and the choice."""
    told = '\n  '.join(f'{one.sentence} {one.action[:1].upper()}{one.action[1:]}.' for one in red)
    return f'the data contradict the servo file:\n  {told}\n--despite-check goes on all the same'
