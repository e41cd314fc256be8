"""What the drive of a servo makes of a recorded command."""

from __future__ import annotations

import numpy as np

from . import state
from .kernel import fresh_state, kernel_of
from .servo import Servo
from .simulate import substeps_of


def driven_current(servo: Servo, theta: np.ndarray, command: np.ndarray, speed: np.ndarray,
                   period: float, begin: float = 0.0) -> np.ndarray:
    """
    Return what a drive makes of a command (V) at a motor speed (rad/s), A, shape (samples, 2).

    At each sample, before its command acts, and in the mean from there to the next. ``begin`` is
    the current that flows at first, A; ``period`` that of the samples, s.
    """
    kernel, x = kernel_of(servo), fresh_state(kernel_of(servo))
    x[state.CURRENT] = begin
    current = np.empty((len(command), 2))
    kernel.drive_current(theta, servo.switches, x, command, speed, current,
                         *substeps_of(servo, period))
    return current
