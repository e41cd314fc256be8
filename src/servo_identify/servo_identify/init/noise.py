"""The noise of a sensor, from a recording alone."""

from __future__ import annotations

import numpy as np

from servo_twin.physics.servo import SENSORS
from servo_twin.recording.recording import COLUMNS, Recording

_SMALLEST = 1e-12


def noise_of(recording: Recording, linear: bool = False) -> dict[str, tuple[float, str, str]]:
    """
    Return (standard deviation, unit, how it was found) for each sensor that was recorded.

    An encoder that counts has its step / sqrt(12). Elsewhere it is the third difference over
    sqrt(20), which a smooth motion hardly moves; by its median, so that jerks count little. The
    command is known, not measured: it has none here.
    """
    found = {}
    for name, sensor in SENSORS.items():
        column = sensor.channel
        if column == 'voltage' or not recording.has(column):
            continue
        size, how = _noise(recording[column])
        if size > _SMALLEST:
            unit = COLUMNS[column]
            if linear:
                unit = {'rad': 'm', 'N m': 'N'}.get(unit, unit)
            found[name] = (size, unit, f'{recording.name}: {how}')
    return found


def _noise(values: np.ndarray) -> tuple[float, str]:
    steps = np.abs(np.diff(values))
    steps = steps[np.isfinite(steps) & (steps > 1e-9 * np.nanmax(np.abs(values)))]
    if len(steps):
        step = float(steps.min())
        whole = np.abs(steps / step - np.round(steps / step))
        if np.mean(whole < 0.02) > 0.95:
            return step / np.sqrt(12.0), 'step of the encoder / sqrt(12)'
    third = np.abs(np.diff(values, 3))
    third = third[np.isfinite(third)]
    if not len(third):
        return 0.0, ''
    return 1.4826 * float(np.median(third)) / np.sqrt(20.0), 'third difference / sqrt(20)'
