"""What a check of recordings found, as a sentence and what to do."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
import re

LEVELS = ('red', 'amber', 'green')
SHOWN = 3  # names before the others are counted
_NUMBER = re.compile(r"(?<![\w\[/'.])\d[\d.]*(e[+-]?\d+)?(?![\w\]/'])")


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
    return [f'{listed(names)}: {sentence}' for sentence, names in of.items()]


def each_once(found: Sequence[Finding]) -> list[Finding]:
    """
    Return findings, those that say the same of several recordings as one about all of them.

    Sentences that differ in their numbers alone are one, with the numbers of the first. Red ones
    stay apart: their recordings may be left out one by one.
    """
    alike: dict[tuple[str, str, str], list[tuple[Finding, str]]] = {}
    for one in found:
        said = one.sentence.removeprefix(f'{one.recording}: ')
        apart = one.recording if one.level == 'red' else ''
        alike.setdefault((apart, without_numbers(said), one.action), []).append((one, said))
    return [several[0][0] if len(several) == 1 else _of_all(several) for several in alike.values()]


def _of_all(several: Sequence[tuple[Finding, str]]) -> Finding:
    """Return findings that say the same as one."""
    (first, said), *_ = several
    names = listed([one.recording for one, _ in several])
    others = any(other != said for _, other in several)
    if others:
        end = '.' if said.endswith('.') else ''
        said = f'{said.removesuffix(".")} (the numbers are of {first.recording}){end}'
    return replace(first, sentence=f'{names}: {said}', recording='')


def without_numbers(text: str) -> str:
    """Return a text with 0 for each number that is no part of a name."""
    return _NUMBER.sub('0', text)


def listed(names: Sequence[str]) -> str:
    """Return names, those beyond some as a number."""
    more = len(names) - SHOWN
    return ', '.join(names[:SHOWN]) + (f' and {more} more' if more > 0 else '')


def refusal(red: Sequence[Finding]) -> str:
    """Return the sentence with which a command refuses data: all that is red, and the choice."""
    told = '\n  '.join(f'{one.sentence} {one.action[:1].upper()}{one.action[1:]}.' for one in red)
    return (f'the data contradict the servo file:\n  {told}\n--despite-check (in Python '
            'despite_check=True) goes on all the same')
