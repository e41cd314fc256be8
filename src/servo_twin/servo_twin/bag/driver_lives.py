"""Which parts of several topics are of one driver, where it was restarted while a bag was made."""

from __future__ import annotations

import numpy as np

from .sample_grid import clocks_apart, sparse, stretches, TimeError, Track

APART, DRIFT = 0.1, 1e-3
"""s by which topics of one driver may differ in an instant, and what is added for each s."""


def lives(tracks: list[Track], warnings: list[str]) -> list[list[Track]]:
    """
    Return the parts of all topics that one driver has sent, life by life as they were recorded.

    A driver that is started again begins its numbers again, and may do so by a clock that was set
    back. Parts are of one life where their stamps overlap and the same numbers have about the
    same instants. A life that some topics lack is left out, and said in ``warnings``: a recorder
    may have heard one topic of a driver before the others when the driver ended. Raises TimeError
    where time runs backwards while the numbers go on, and without any life.
    """
    parts = [stretches(item) for item in tracks]
    found: list[list[Track]] = []
    for part in sum(parts, []):
        near = [life for life in found if part.topic != life[-1].topic
                and _together(life[0], part)]
        if near:
            min(near, key=lambda life: clocks_apart(life[0], part)).append(part)
        else:
            found.append([part])
    whole = [life for life in found if len(life) == len(tracks)]
    for life in found:
        if len(life) < len(tracks):
            heard = ', '.join(sorted(part.topic for part in life))
            warnings.append(f'{max(part.size for part in life)} samples of a driver that was '
                            f'heard on {heard} alone are left out')
    if not whole:
        raise TimeError('the topics have no time in common: ' + ', '.join(
            f'{part.topic} from {part.spans["stamp"].min() / 1e9:.3f} s to '
            f'{part.spans["late"].max() / 1e9:.3f} s' for part in sum(parts, [])))
    return whole


def _together(one: Track, other: Track) -> bool:
    """Tell whether two parts overlap in time, and number their samples by one clock."""
    begins, ends = (one.spans['stamp'].min(), other.spans['stamp'].min()), (
        one.spans['late'].max(), other.spans['late'].max())
    return max(begins) <= min(ends) and clocks_apart(one, other) <= (
        APART + DRIFT * (max(ends) - min(begins)) / 1e9)


def parted(life: list[Track]) -> list[list[Track]]:
    """
    Return the parts of one life between pauses, where they leave most of it without a sample.

    A pause is a hole in all topics that is longer than all samples together, as of a driver that
    was deactivated over lunch while the recorder was left running.
    """
    longest = min(part.size for part in life)
    if not sparse(life):
        return [life]
    cuts = [cut for cut in _pauses(life[0], longest) if all(
        any(low < cut < high for low, high in _holes(part, longest)) for part in life)]
    edges = [-np.inf, *cuts, np.inf]
    found = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        between = [Track(part.topic, part.spans[(part.spans['first'] > low)
                                                & (part.spans['first'] < high)]) for part in life]
        if all(len(part.spans) for part in between):
            found.append(between)
    return found or [life]


def _pauses(part: Track, longest: int) -> list[float]:
    """Return a number in the middle of each hole."""
    return [(low + high) / 2 for low, high in _holes(part, longest)]


def _holes(part: Track, longest: int) -> list[tuple[int, int]]:
    """Return the numbers between which a topic has none, where they are so far apart."""
    spans = part.spans[np.argsort(part.spans['first'], kind='stable')]
    reached = np.maximum.accumulate(spans['end'])[:-1]
    begins = spans['first'][1:]
    far = begins - reached > longest
    return list(zip((reached[far] - 1).tolist(), begins[far].tolist(), strict=True))
