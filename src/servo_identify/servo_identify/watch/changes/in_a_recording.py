"""What the identify node would say of the changes in a recording."""

from __future__ import annotations

import numpy as np

from servo_twin.lockstep.whole_recording import answer
from servo_twin.physics.servo import Servo
from servo_twin.recording.joined_samples import samples_of
from servo_twin.recording.recording import BALANCES, Recording

from .alarm import Alarm
from .change_detector import ChangeDetector, Settings
from .change_place import AFTER, ChangePlace, Located
from .excitation_level import driving, half_window

_STEP = 100  # samples that are given at once


def watch(servo: Servo, recording: Recording, settings: Settings) -> list[Alarm]:
    """Return the alarms of a recording."""
    residuals, covariates = watched(servo, recording)
    detector = ChangeDetector(BALANCES, recording.period, settings)
    alarms: list[Alarm] = []
    for at in range(0, len(residuals), _STEP):
        alarms += detector.push(at, residuals[at:at + _STEP], covariates[at:at + _STEP])
    return alarms


def located(servo: Servo, recording: Recording, settings: Settings, alarm: Alarm
            ) -> Located | None:
    """Return where the change of an alarm is; None: that is not known."""
    place = ChangePlace(servo, recording.period, settings.block, settings.learn)
    rows = _padded(recording, place.half)
    end = min(len(recording), alarm.sequence + round(AFTER / recording.period))
    for at in range(0, end, _STEP):
        place.push(at, rows[at:at + _STEP + 2 * place.half])
    return place.locate(alarm.since)


def watched(servo: Servo, recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return what the node gives its detector: residuals (n, balances), covariates."""
    found = answer(recording, servo)
    return (np.column_stack([found.residual[name] for name in BALANCES]),
            driving(_padded(recording, half_window(recording.period)), recording.period,
                    servo.values['mechanism.ratio']))


def _padded(recording: Recording, half: int) -> np.ndarray:
    """Return the samples of a recording with ``half`` of none on both sides."""
    return np.pad(samples_of(recording.columns), ((half, half), (0, 0)), constant_values=np.nan)
