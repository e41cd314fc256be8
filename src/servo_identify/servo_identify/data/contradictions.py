"""What the check finds red, for those who fit values to recordings or follow them."""

from __future__ import annotations

from collections.abc import Sequence

from servo_twin.physics.servo import Servo

from .finding import refusal
from .long_bags import Long
from .recording_check import check


def contradictions(recordings: Sequence[Long], servo: Servo, despite: bool) -> tuple[str, ...]:
    """
    Return what is red of the check, with what to do: values fitted to that would be wrong.

    Raises ValueError that says it, unless ``despite`` it one goes on.
    """
    red = [one for one in check(recordings, servo) if one.level == 'red']
    if red and not despite:
        raise ValueError(refusal(red))
    return tuple(f'{one.sentence} To do: {one.action}.' for one in red)
