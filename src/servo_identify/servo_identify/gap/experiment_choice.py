"""What would separate two causes that these recordings cannot tell apart."""

from __future__ import annotations

import numpy as np

from .ambiguity import shown
from .candidates import Candidate
from .explanation import fit
from .joined import joined
from .menu import DURATION, recordings_of_the_menu
from .screening import Screening
from .shapes import refined
from .stack import Stack

FOREMOST = 3  # recordings of the menu for which the other cause is refined before it is judged
PAIRS = 2  # pairs looked at before none is found that a recording separates
READABLE = ('drive.', 'mechanism.')  # values that an instrument can read by themselves
READ = 0.02  # share of such a value by which two causes must differ in it to be told by it


def next_experiment(evidence, screening: Screening, kept: list[int]) -> dict:
    """
    Return ``{separates, family, settings, expected_ratio}``, empty where nothing is ambiguous.

    Each recording of a menu is simulated with the augmented twin under the noise of the rig and
    put beside the recordings that are there. The best is the one that shows most plainly what the
    other cause leaves, at the shapes and values within tolerance with which it explains them all.
    ``expected_ratio`` is what it leaves there, as mean squares over the least that is seen (1).
    Where none reaches that, ``family`` is empty, and ``measure``, if one of the two is a value,
    what it must be by the one and by the other: ``{parameter, unit, values}``, the last by cause.
    ``settings`` are SI: amplitudes in V or rad/s at the load, frequencies in Hz, accelerations in
    rad/s2.
    """
    pairs = _pairs(evidence.choices, kept)
    if not pairs:
        return {}
    menu = list(recordings_of_the_menu(evidence))
    for one, other in pairs[:PAIRS]:
        best, told = _most_telling(menu, screening, kept, one, other)
        if told > 1.0:
            family, settings, _ = menu[best]
            return {'separates': _names(screening, one, other), 'family': family,
                    'settings': {**settings, 'duration': DURATION}, 'expected_ratio': told}
    nothing = {'separates': _names(screening, *pairs[0]), 'family': '', 'settings': {}}
    value = _telling_value(evidence, screening, kept, *pairs[0])
    return {**nothing, 'measure': value} if value else nothing


def separation(screening: Screening, more: Stack, kept: list[int], one: int,
               other: Candidate, closely: bool = True) -> float:
    """
    Return how plainly further recordings would show that it is one cause and not another.

    Mean squares that the other leaves of ``more`` over the least that is seen: above 1 it is told
    apart. The other takes, of its shapes in the library, those with which it explains all
    recordings best, ``closely`` refined.
    """
    versions = [c for c, known in enumerate(screening.library.candidates)
                if known.key == other.key]
    together = joined(screening, more, [*kept, *versions])
    rest = [number for number, c in enumerate(kept) if c != one]
    others = range(len(kept), len(kept) + len(versions))
    best = min(others, key=lambda number: together.loss([*rest, number]))
    if closely:
        best = refined(together, best, rest)
    ratios = shown(together, [*rest, kept.index(one)], [*rest, best])
    first = len(screening.stack.balances)
    return max((ratio for number, ratio in ratios.items() if number >= first), default=0.0)


def _pairs(choices, kept: list[int]) -> list[tuple[int, Candidate]]:
    return [(one, other) for choice, one in zip(choices, kept, strict=True)
            for other in choice.ambiguous]


def _names(screening: Screening, one: int, other: Candidate) -> list[str]:
    return [screening.library.candidates[one].name, other.name]


def _most_telling(menu, screening: Screening, kept: list[int], one: int,
                  other: Candidate) -> tuple[int, float]:
    """Return (number in the menu, separation) of the recording that separates two causes most."""
    roughly = [separation(screening, more, kept, one, other, closely=False)
               for _, _, more in menu]
    foremost = [number for number in np.argsort(roughly)[::-1][:FOREMOST] if roughly[number] > 1.0]
    told = {number: separation(screening, menu[number][2], kept, one, other)
            for number in foremost}
    best = max(told, key=told.get, default=-1)
    return int(best), told.get(best, 0.0)


def _telling_value(evidence, screening: Screening, kept: list[int], one: int,
                   other: Candidate) -> dict:
    """
    Return ``{parameter, unit, values}`` of the value that one of two causes is, or {}.

    A drive's gain that is off and a current sensor that reads wrong move every signal alike; the
    gain itself, read by an instrument, is one number for the one and another for the other.
    """
    servo = evidence.servo
    for path in (*screening.library.candidates[one].paths, *other.paths):
        if path not in servo.values or not path.startswith(READABLE):
            continue
        rival = screening.library.candidates.index(other)
        slot = screening.stack.extended.slot(path)
        values = [float(fit(screening, chosen).theta[slot])
                  for chosen in (kept, [rival if c == one else c for c in kept])]
        if abs(values[0] - values[1]) >= READ * max(map(abs, values)):
            return {'parameter': path, 'unit': servo.unit(path),
                    'values': dict(zip(_names(screening, one, other), values, strict=True))}
    return {}
