"""What the drive of a servo makes of a recorded command."""

from __future__ import annotations

import numpy as np

from servo_twin.physics import state
from servo_twin.physics.kernel import fresh_state, kernel_of
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import substeps_of
from servo_twin.recording.recording import Recording

from .measured import Measured


def drive_current(servo: Servo, theta: np.ndarray, command: np.ndarray, speed: np.ndarray,
                  measured: Measured | Recording, around: bool = False) -> np.ndarray:
    """
    Return what a servo's drive makes of a command (V) at a motor speed (rad/s), A.

    At each sample where the current is measured as well. Else, or ``around`` each, it is what acts
    on the shaft: the mean from half a sample before to half a sample after, since a command is
    held to the next.
    """
    kernel, x = kernel_of(servo), fresh_state(kernel_of(servo))
    recording = measured.recording if isinstance(measured, Measured) else measured
    if recording.has('current'):
        x[state.CURRENT] = np.nan_to_num(recording['current'][0])
    current = np.empty((len(command), 2))
    substeps, h = substeps_of(servo, recording.period)
    kernel.drive_current(theta, servo.switches, x, command, speed, current, substeps, h)
    if recording.has('current') and not around:
        return current[:, 0]
    lasting = current[:, 1]
    return 0.5 * (lasting + np.append(lasting[:1], lasting[:-1]))
