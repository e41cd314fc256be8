"""What the drive makes of a recorded command, and which of it a recording shows or feels."""

from __future__ import annotations

import numpy as np

from servo_twin.physics.driven_current import driven_current
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

TURNS = 8  # of a loop that may go to a row


def between_rows(count: int) -> np.ndarray:
    """Return the instants of a loop that turns TURNS times a row, in rows, from the first on."""
    return np.arange(TURNS * (count - 1) + 1) / TURNS


def there_and_around(servo: Servo, theta: np.ndarray, command: np.ndarray, speed: np.ndarray,
                     recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """
    Return what a drive makes of a command (V) at a motor speed (rad/s), A, at each sample.

    There, before its command acts; and around it, the mean from half a sample before to half a
    sample after, since a command is held to the next.
    """
    begin = float(np.nan_to_num(recording['current'][0])) if recording.has('current') else 0.0
    there, lasting = driven_current(servo, theta, command, speed, recording.period, begin).T
    return there, 0.5 * (lasting + np.append(lasting[:1], lasting[:-1]))


def moving_between(servo: Servo, command: np.ndarray, speed: np.ndarray,
                   recording: Recording) -> np.ndarray:
    """
    Return by how much the current differs, A, where the command goes straight from row to row.

    A log that is slower than the loop does not show how it goes.
    """
    rows, fine = np.arange(len(command)), between_rows(len(command))
    begin = float(np.nan_to_num(recording['current'][0]))

    def before(command: np.ndarray, speed: np.ndarray, period: float) -> np.ndarray:
        return driven_current(servo, servo.theta, command, speed, period, begin)[:, 0]

    straight = before(np.interp(fine, rows, command), np.interp(fine, rows, speed),
                      recording.period / TURNS)[::TURNS]
    return np.nan_to_num(straight - before(command, speed, recording.period))


def drive_current(servo: Servo, theta: np.ndarray, command: np.ndarray, speed: np.ndarray,
                  recording: Recording) -> np.ndarray:
    """Return what is to be held against the current, where it is measured, or what acts, A."""
    there, around = there_and_around(servo, theta, command, speed, recording)
    return there if recording.has('current') else around
