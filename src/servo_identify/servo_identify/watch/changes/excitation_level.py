"""How a rig is driven, as far as the residual of an imperfect twin may depend on it."""

from __future__ import annotations

import numpy as np

from servo_twin.recording.joined_samples import CHANNELS, LOAD_POSITION, MOTOR_POSITION

DIRECTION = 1
"""Column of :func:`driving` that holds the direction."""

_WINDOW = 0.02  # s over which speed is measured
_SLOW = 0.03  # rad/s at the load, in which the direction fades
_EXTERNAL = CHANNELS.index('external_torque')


def half_window(period: float) -> int:
    """Return how many samples :func:`driving` needs before and after those it answers."""
    return max(1, round(0.5 * _WINDOW / period))


def driving(rows: np.ndarray, period: float, ratio: float) -> np.ndarray:
    """
    Return what excites a balance, five columns.

    These are speed of the load (rad/s), its direction (-1 to 1), external torque (N m), sine and
    cosine of the load's angle.
    ``rows`` (n + 2 half_window, len(CHANNELS)); the answer has shape (n, 5). Without a load
    encoder the motor's angle over ``ratio`` is taken.
    """
    half = half_window(period)
    angle = rows[:, LOAD_POSITION]
    if not np.isfinite(angle).any():
        angle = rows[:, MOTOR_POSITION] / ratio
    speed = (angle[2 * half:] - angle[:-2 * half]) / (2.0 * half * period)
    external = np.nan_to_num(rows[half:-half, _EXTERNAL])
    here = angle[half:-half]
    return np.column_stack([speed, speed / (np.abs(speed) + _SLOW), external, np.sin(here),
                            np.cos(here)])
