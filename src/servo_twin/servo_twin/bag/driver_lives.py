"""Which parts of several topics are of one driver, where it was restarted while a bag was made."""

from __future__ import annotations

import numpy as np

from .sample_grid import sparse, stretches, TimeError, Track


def lives(tracks: list[Track], warnings: list[str]) -> list[list[Track]]:
    """
    Return the parts of all topics that one driver has sent, life by life in the order of time.

    A driver that is started again begins its numbers again; parts whose stamps overlap are of one
    life. A life that some topics lack is left out, and said in ``warnings``: a recorder may have
    heard one topic of a driver before the others when the driver ended. Raises TimeError where
    time runs backwards, where a topic begins again and another one goes on, and without any life.
    """
    parts = sorted((part for item in tracks for part in stretches(item)),
                   key=lambda part: int(part.spans['stamp'].min()))
    found: list[list[Track]] = []
    reached = 0
    for part in parts:
        if not found or part.spans['stamp'].min() > reached:
            found.append([])
        found[-1].append(part)
        reached = max(reached, int(part.spans['late'].max()))
    order = {item.topic: k for k, item in enumerate(tracks)}
    whole = []
    for life in found:
        heard = [part.topic for part in life]
        if len(set(heard)) < len(heard):
            counts = {topic: heard.count(topic) for topic in order}
            raise TimeError('sequence numbers start again a different number of times: '
                            f'{counts}')
        if len(life) == len(tracks):
            whole.append(sorted(life, key=lambda part: order[part.topic]))
        else:
            warnings.append(f'{max(part.size for part in life)} samples of a driver that was '
                            f'heard on {", ".join(sorted(heard))} alone are left out')
    if not whole:
        raise TimeError('the topics have no time in common: ' + ', '.join(
            f'{part.topic} from {part.spans["stamp"].min() / 1e9:.3f} s to '
            f'{part.spans["late"].max() / 1e9:.3f} s' for part in parts))
    return whole


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
