"""Recordings of one machine with what the check looks at in them, each worked out once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .astray import astray
from .excitation import Excitation, excitation, WIDTHS
from .finding import Finding
from .shown_factor import Off, off_references
from .shown_parting import parted, Parting
from .signals import Signals, signals

Known = Mapping[int, Excitation | None]

SURE = 5.0
"""Nats by which a mistake must beat its absence, its rarity counted: 150 to 1."""
MOST_RECORDINGS = 8


@dataclass(frozen=True)
class LookedOver:
    """
    Some recordings of a machine, what each excites and its smoothed channels.

    ``shown`` and ``seen`` hold None where a recording has too few samples.
    """

    servo: Servo
    recordings: Sequence[Recording]
    shown: Sequence[Excitation | None]
    seen: Sequence[Signals | None]

    @cached_property
    def usable(self) -> list[tuple[Recording, Signals]]:
        """Recordings whose channels may be held against each other: no encoders part in them."""
        return [(one, at) for one, at in self.every if one.name not in self.parted]

    @cached_property
    def parted(self) -> dict[str, Parting]:
        """How far the two encoders part, at the load, by the name of a recording."""
        found = {one.name: parted(at, self.servo) for one, at in self.every}
        return {name: apart for name, apart in found.items() if apart}

    @cached_property
    def off(self) -> list[Off]:
        """References that are off by a factor."""
        return off_references(self.usable, self.servo, SURE)

    @cached_property
    def astray(self) -> dict[str, list[Finding]]:
        """What is to be said of references that the angle does not follow, by channel."""
        return astray(self.usable, self.servo)

    @cached_property
    def families(self) -> dict[str, list[tuple[str, Signals]]]:
        """Names and channels of the usable recordings, by their family."""
        found: dict[str, list[tuple[str, Signals]]] = {}
        for one, at in self.usable:
            found.setdefault(one.family, []).append((one.name, at))
        return found

    @property
    def every(self) -> list[tuple[Recording, Signals]]:
        """Recordings that have enough samples."""
        return [(one, at) for one, at in zip(self.recordings, self.seen, strict=True)
                if at is not None]


def looked_over(recordings: Sequence[Recording], servo: Servo,
                known: Known | None = None) -> LookedOver:
    """
    Return at most :data:`MOST_RECORDINGS` of the recordings, evenly over all, with their channels.

    ``known`` is what recordings excite, by their identity, where that was found already.
    """
    chosen, known = _spread(recordings, MOST_RECORDINGS), known or {}
    shown = [known[id(one)] if id(one) in known else excitation(one, servo) for one in chosen]
    return LookedOver(servo, chosen, shown, [
        found.signals if found else signals(one, WIDTHS[1])
        for one, found in zip(chosen, shown, strict=True)])


def _spread(recordings: Sequence[Recording], most: int) -> list[Recording]:
    """Return at most so many recordings, evenly over all."""
    if len(recordings) <= most:
        return list(recordings)
    places = np.linspace(0, len(recordings) - 1, most).round().astype(int)
    return [recordings[k] for k in places]
