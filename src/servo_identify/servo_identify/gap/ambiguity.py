"""What each cause that was chosen gains, and what else could be there in its place."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from .balance import BALANCES
from .candidates import Candidate
from .comparison import as_good, complexity, SEEN, surely_worse
from .screening import Screening
from .shapes import refined

MAINLY = 0.3  # share of the most that a cause takes away in one balance, for another to count
ALIKE = 0.9  # share of a cause's gain that another must reach to be called ambiguous with it
MATTERS = 1.0  # mean square in a recording, of noise and margin, below which it may be left
LIKELY = 2.0  # standard deviations over blocks by which a richer law must leave less to be listed


@dataclass(frozen=True)
class Choice:
    """A cause that the screening took, with what else would have done."""

    candidate: Candidate
    gain: float  # cross-validated drop of the sum of squares
    significance: float  # standard deviations of the drop over blocks
    balances: tuple[str, ...] = ()  # those in which it takes most away
    ambiguous: tuple[Candidate, ...] = ()


def explain(screening: Screening, chosen: list[int]) -> list[Choice]:
    """Say of each choice what it gains and what could take its place."""
    answers = []
    for one in chosen:
        rest = [c for c in chosen if c != one]
        gain = screening.loss(rest) - screening.loss(chosen)
        ranked = sorted(_alike(screening, one, chosen, gain), key=lambda pair: -pair[0])
        answers.append(Choice(
            screening.library.candidates[one], gain, screening.significance(one, rest),
            taken_from(screening, rest, chosen), tuple(other for _, other in ranked)))
    return answers


def _alike(screening: Screening, one: int, chosen: list[int],
           gain: float) -> Iterator[tuple[float, Candidate]]:
    """Yield (share of the gain, version) of each other cause that could be there instead."""
    rest = [c for c in chosen if c != one]
    start, shares = screening.loss(rest), {}
    taken = {screening.library.candidates[c].key for c in chosen}
    for c, other in enumerate(screening.library.candidates):
        if other.key in taken or start - screening.least([*rest, c]) < ALIKE * gain:
            continue
        share = (start - screening.loss([*rest, c])) / max(gain, 1e-12)
        if share >= ALIKE:
            shares.setdefault(other.key, []).append((share, c))
    for versions in shares.values():
        for share, c in sorted(versions, reverse=True):
            if stands_in(screening, one, refined(screening, c, rest), rest):
                yield share, screening.library.candidates[c]
                break


def stands_in(screening: Screening, one: int, other: int, rest: list[int]) -> bool:
    """
    Tell whether these recordings leave open that another cause is there instead of one.

    It may leave no more that counts in any balance, nor surely more where a recording shows
    it. One with more numbers must be likely to leave less: as good as anything is its limit
    at which it is the simpler law, and no recording could tell it from that. Of two laws of the
    mesh it is enough that no recording shows it, short of that limit: what they differ by within
    a kink is blurred before they are asked.
    """
    kept, instead = [*rest, one], [*rest, other]
    left, least = screening.squares(instead), screening.squares(kept)
    if not as_good(left, least, 1.5, 0.3):
        return False
    richer = complexity(screening, other) > complexity(screening, one)
    blurred = _of_mesh(screening, (one, other)) and not at_a_limit(screening, other)
    if (blurred or not richer) and max(shown(screening, kept, instead).values()) <= 1.0:
        return True
    if richer:
        drop = screening.residual(kept)**2 - screening.residual(instead)**2
        return screening.sureness(drop) > LIKELY
    return not surely_worse(screening, other, one, rest)


def _of_mesh(screening: Screening, some: Iterable[int]) -> bool:
    return all(screening.library.candidates[c].of_mesh for c in some)


def at_a_limit(screening: Screening, one: int) -> bool:
    """Tell whether a shape of a candidate came out at an end, where it is a simpler law."""
    return any(screening.shapes.at_an_end(path, value)
               for path, value in screening.library.candidates[one].shapes)


def shown(screening: Screening, kept: list[int], instead: list[int]) -> dict[int, float]:
    """
    Return by recording how plainly it shows that other causes leave more than those kept.

    Mean squares of what they leave over the least that is seen, in the balance in which that
    is most: above 1 it is seen. Of laws of the mesh only what matters is: no law has quite the
    kink that a rig has, and each leaves a little of it.
    """
    stack = screening.stack
    least, left = screening.residual(kept)**2, screening.residual(instead)**2
    times, more = SEEN
    granted = MATTERS if _of_mesh(screening, set(kept) ^ set(instead)) else 0.0
    ratios: dict[int, float] = {}
    for number in np.unique(stack.recording):
        for index in np.unique(stack.balance):
            rows = (stack.recording == number) & (stack.balance == index)
            if rows.any():
                seen = max(granted, times * np.mean(least[rows]) + more)
                ratio = float(np.mean(left[rows]) / seen)
                ratios[int(number)] = max(ratio, ratios.get(int(number), 0.0))
    return ratios


def taken_from(screening: Screening, rest: list[int], chosen: list[int]) -> tuple[str, ...]:
    """Balances in which a cause takes away a good part of what it takes away in all."""
    drop = screening.residual(rest)**2 - screening.residual(chosen)**2
    taken = {int(b): float(drop[screening.stack.balance == b].sum())
             for b in np.unique(screening.stack.balance)}
    return tuple(BALANCES[b] for b, part in taken.items()
                 if part > 0.0 and part >= MAINLY * max(taken.values()))
