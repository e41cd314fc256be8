"""How far, how fast and with what torque a rig moved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from servo_twin.recording.recording import Recording

CHANNELS = ('motor_position', 'load_position', 'torque', 'current')


def reached(recordings: list[Recording]) -> np.ndarray:
    """Return the largest travel (rad), speed (rad/s) and torque (N m) at the load."""
    most = np.zeros(3)
    for one in recordings:
        columns: dict[str, Any] = {name: one[name] for name in CHANNELS}
        if not one.has('load_position'):
            columns['load_position'] = one['motor_position']
        columns['period'] = one.period
        most = np.maximum(most, reach_of(columns))
    return most


def reach_of(columns: Mapping[str, Any]) -> np.ndarray:
    """Return the same of one recording, by its columns and ``period`` (s)."""
    period = columns['period']
    angle, torque = columns['load_position'], columns['torque']
    step = max(1, round(0.02 / period))
    way = angle[step:] - angle[:-step]
    return np.array([
        np.nanmax(angle) - np.nanmin(angle),
        np.nanmax(np.abs(way), initial=0.0) / (step * period),
        np.nanmax(np.abs(torque)) if np.isfinite(torque).any() else 0.0])
