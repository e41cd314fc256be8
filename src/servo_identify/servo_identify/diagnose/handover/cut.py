"""Recordings made ready to be simulated, once for all files that read them alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ...fit.segments import CHANNELS, Course, courses_of


class Cut:
    """Recordings cut into horizons, kept for the files that read them alike."""

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], tuple[Course, ...]] = {}

    def courses(self, servo: Servo, recordings: Sequence[Recording], mode: str
                ) -> tuple[Course, ...]:
        """Return the recordings ready for a servo, see :func:`courses_of`."""
        noise = np.array([servo.noise(channel) for channel in CHANNELS])
        key = (*map(id, recordings), mode, servo.values['mechanism.ratio'], noise.tobytes())
        if key not in self._known:
            self._known[key] = courses_of(servo, recordings, mode, None, None)
        return self._known[key]
