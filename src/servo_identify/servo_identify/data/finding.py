"""What a check of recordings found, as a sentence and what to do."""

from __future__ import annotations

from dataclasses import dataclass

LEVELS = ('red', 'amber', 'green')


@dataclass(frozen=True)
class Finding:
    """
    One thing that was found.

    ``level`` is one of :data:`LEVELS`: red where an answer would be wrong, amber where it would
    be less than it could be, green where all is well. ``action`` says what to do, '' for green.
    """

    level: str
    sentence: str
    action: str = ''
