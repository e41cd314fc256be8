"""What a check of recordings found, as a sentence and what to do."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

LEVELS = ('red', 'amber', 'green')
SHOWN = 3  # names before the others are counted


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


def said_once(said: Iterable[tuple[str, str]]) -> list[str]:
    """Return the sentences of (name, sentence), each once, behind the names that it is said of."""
    of: dict[str, list[str]] = {}
    for name, sentence in said:
        of.setdefault(sentence, []).append(name)
    return [f'{_listed(names)}: {sentence}' for sentence, names in of.items()]


def each_once(found: Sequence[Finding]) -> list[Finding]:
    """
    Return findings, those that say the same of several recordings as one about all of them.

    Red ones stay apart: their recordings may be left out one by one.
    """
    alike: dict[tuple[str, str, str], list[Finding]] = {}
    for one in found:
        said = one.sentence.removeprefix(f'{one.recording}: ')
        apart = one.recording if one.level == 'red' else ''
        alike.setdefault((apart, said, one.action), []).append(one)
    return [several[0] if len(several) == 1 else replace(
        several[0], sentence=said_once((one.recording, said) for one in several)[0], recording='')
        for (_, said, _), several in alike.items()]


def _listed(names: Sequence[str]) -> str:
    more = len(names) - SHOWN
    return ', '.join(names[:SHOWN]) + (f' and {more} more' if more > 0 else '')


def refusal(red: Sequence[Finding]) -> str:
    """Return the sentence with which a command refuses data: all that is red, and the choice."""
    told = '\n  '.join(f'{one.sentence} {one.action[:1].upper()}{one.action[1:]}.' for one in red)
    return f'the data contradict the servo file:\n  {told}\n--despite-check goes on all the same'
