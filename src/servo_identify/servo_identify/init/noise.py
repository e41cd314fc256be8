"""The noise of a sensor, from a recording alone."""

from __future__ import annotations

import numpy as np

from servo_twin.physics.servo import SENSORS
from servo_twin.recording.recording import COLUMNS, Recording

_SMALLEST = 1e-12


def noise_of(recording: Recording, linear: bool = False) -> dict[str, tuple[float, str, str]]:
    """
    Return (standard deviation, unit, how it was found) for each sensor that was recorded.

    It is the third difference over sqrt(20), which a smooth motion hardly moves; by its median, so
    that jerks count little. A reading in whole steps has no less than its step / sqrt(12). The
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
    third = np.abs(np.diff(values, 3))
    third = third[np.isfinite(third)]
    if not len(third):
        return 0.0, ''
    seen = 1.4826 * float(np.median(third)) / np.sqrt(20.0)
    steps = np.abs(np.diff(values))
    steps = steps[np.isfinite(steps) & (steps > 1e-9 * np.nanmax(np.abs(values)))]
    if len(steps):
        step = float(steps.min())
        whole = np.abs(steps / step - np.round(steps / step))
        rounded = step / np.sqrt(12.0)
        # the median of whole steps is itself a whole step, so it is right to half of one
        if np.mean(whole < 0.02) > 0.95 and seen < 2.0 * rounded:
            return rounded, 'step of the reading / sqrt(12)'
    return seen, 'third difference / sqrt(20)'
