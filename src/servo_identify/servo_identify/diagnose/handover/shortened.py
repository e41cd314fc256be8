"""As much of the recordings as a refit, or the judgement of one, needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from servo_twin.recording.recording import Recording

SECONDS = 16.0  # of recordings that a refit runs over: more moves its values by little
STEPS = 160_000  # of the integration that it may run over in any case: long ones are cheap
JUDGED = 60.0  # s of the accept recordings that a choice is judged on


def judging(accepting: Sequence[Recording], step: float) -> list[Recording]:
    """Return as much of the accept recordings as a choice is judged on; ``step`` as below."""
    return shortened(accepting, step, JUDGED)


def shortened(recordings: Sequence[Recording], step: float,
              seconds: float = SECONDS) -> list[Recording]:
    """
    Return as much of the recordings as a refit needs; ``step`` is that of the integration, s.

    Where all together are longer, one of the replicates of each excitation stands for the others,
    and of what is left each is cut to its first part.
    """
    several = list(recordings)
    seconds = max(seconds, STEPS * step)
    if sum(one.duration for one in several) > seconds:
        several = list({one.family or one.name: one for one in reversed(several)}.values())[::-1]
    together = sum(one.duration for one in several)
    if together <= seconds:
        return several
    kept = []
    for one in several:
        size = max(int(3.0 / one.period), int(len(one) * seconds / together))
        kept.append(replace(one, columns={n: np.ascontiguousarray(c[:size])
                                          for n, c in one.columns.items()}))
    return kept
