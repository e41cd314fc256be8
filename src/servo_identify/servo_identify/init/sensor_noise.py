"""The noise of a sensor, from a recording alone."""

from __future__ import annotations

import numpy as np

from servo_twin.physics.servo import SENSORS, Servo
from servo_twin.recording.recording import COLUMNS, Recording

from ..data.white_noise import FOURTH, QUARTILE

_SMALLEST = 1e-12
_FEWEST, _WHOLE = 16, 0.05  # steps that show a resolution, how near to whole ones they are
_ROUNDING = 1.2  # times the noise of rounding, up to which a reading shows nothing else


def noise_of(recording: Recording, servo: Servo) -> dict[str, tuple[float, str, str]]:
    """
    Return (standard deviation, unit, how it was found) for each sensor that was recorded.

    It is what differs from sample to sample: a motion is smooth, noise is not. The current follows
    the command, which is taken off. A reading in whole steps has at least the noise of rounding
    to them. The command is known, not measured: it has none.
    """
    found = {}
    for name, sensor in SENSORS.items():
        channel = sensor.channel
        if channel == 'voltage' or not recording.has(channel):
            continue
        step = _step(recording[channel])
        several = [recording[channel]]
        if channel == 'current':
            several += [recording[channel] - told for told in _commanded(recording, servo)]
        size, rounded = min(_scatter(one, step) for one in several), step / np.sqrt(12.0)
        how = 'scatter from sample to sample'
        if size < _ROUNDING * rounded:
            size, how = rounded, f'resolution {step:.3g} / sqrt(12)'
        if size > _SMALLEST:
            unit = servo.reads(COLUMNS[channel], f'sensors.{name}.noise')
            found[name] = (size, unit, f'{recording.name}: {how}')
    return found


def _step(x: np.ndarray) -> float:
    """Return the step of a reading, which a table may have rounded; 0 where it has none."""
    steps = np.abs(np.diff(x[np.isfinite(x)]))
    steps = steps[steps > 1e-9 * np.max(np.abs(x), initial=0.0, where=np.isfinite(x))]
    if len(steps) < _FEWEST:
        return 0.0
    first = float(steps.min())
    few = steps[steps < 8.5 * first]
    step = float(np.sum(few) / np.sum(np.round(few / first)))
    few = steps[steps < 100.0 * step]
    whole = np.abs(few / step - np.round(few / step)) < _WHOLE
    return step if np.mean(whole) > 0.95 else 0.0


def _scatter(x: np.ndarray, step: float) -> float:
    """
    Return the standard deviation of white noise on a smooth signal that is read in steps.

    The median of whole steps is a whole step. A step of chance is added and taken off again.
    """
    fourth = np.diff(x[np.isfinite(x)], 4)
    if not len(fourth):
        return 0.0
    fourth = fourth + step * np.random.default_rng(0).uniform(-0.5, 0.5, len(fourth))
    spread = float(np.median(np.abs(fourth))) / QUARTILE
    return float(np.sqrt(max(spread**2 - step**2 / 12.0, 0.0))) / FOURTH


def _commanded(recording: Recording, servo: Servo) -> list[np.ndarray]:
    """
    Return the part of the current that steps with the command, A, as measured before and after.

    The part of the speed is smooth. Nothing for a drive whose loops lie in between.
    """
    gain = servo.values.get('drive.gain')
    if not (recording.has('voltage') and isinstance(gain, float)):
        return []
    winding = (servo.values['drive.resistance'] if servo.drive.name == 'voltage_drive' else 1.0)
    told = gain / winding * recording['voltage']
    return [told, np.concatenate((told[:1], told[:-1]))]
