"""In which recordings an equation is off, and in which it is not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..selection.search import Search
from .sizes import listed

MOST = 4  # recordings that a sentence names


def by_recording(search: Search, equation: int) -> dict[str, float]:
    """
    Return the root mean square of one equation in each recording, in noise and margin, by name.

    ``equation`` is its place in the regression; nothing is explained. Recordings in which it has
    no residual are left out.
    """
    regression = search.regression
    errors, counts = search.nothing.held_out[equation], regression.counts[equation]
    found = {}
    for number, one in enumerate(regression.samples.errors):
        mine = regression.recording == number
        size = int(counts[mine].sum())
        if size:
            found[one.measured.recording.name] = float(np.sqrt(errors[mine].sum() / size))
    return found


def told(sizes: Mapping[str, float], limit: float) -> str:
    """
    Return in which recordings an equation is off, as a sentence; '' where it is off in all.

    ``limit`` is the size from which it is certainly off.
    """
    off, quiet = ([name for name, size in sizes.items() if (size > limit) == above]
                  for above in (True, False))
    if not off or not quiet:
        return ''
    return f' It shows in {listed(_first(off))}, and not in {listed(_first(quiet))}.'


def _first(names: Sequence[str]) -> list[str]:
    """Return the first of many names, and how many there are besides."""
    return list(names) if len(names) <= MOST else [
        *names[:MOST - 1], f'{len(names) - MOST + 1} more']
