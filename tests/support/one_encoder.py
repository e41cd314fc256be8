"""A machine that one encoder reads: its servo file, and what that encoder counts."""

from collections.abc import Iterable, Mapping

import numpy as np

from servo_twin.description import servo_file
from servo_twin.physics.servo import Servo


def head_of(name: str, constant: float, inertias: tuple[float, float], ratio: float,
            noise: float) -> str:
    """
    Return the head of a servo file, without effects, for :func:`servo_of`.

    ``constant`` (N m/A), ``inertias`` (kg m2) of rotor and load, ``noise`` (A) of the current.
    """
    rotor, load = inertias
    return f"""
servo: {name}
drive: {{type: current, gain: 1.0, torque_constant: {constant}}}
mechanism: {{type: MECHANISM, rotor_inertia: {rotor}, load_inertia: {load}, ratio: {ratio}}}
sensors:
  SHAFT: {{noise: COUNT}}
  current_sensor: {{noise: {noise}}}
"""


def servo_of(text: str, shaft: str, counts: Mapping[str, float], mechanism: str) -> Servo:
    """Return the servo of a file with words in it that :func:`filled` fills in."""
    return servo_file.loads(filled(text, shaft, counts, mechanism))


def filled(text: str, shaft: str, counts: Mapping[str, float], mechanism: str) -> str:
    """
    Return the text of a servo file with the words MECHANISM, SHAFT and COUNT filled in.

    ``shaft`` is the column of the encoder, ``counts`` (rad) that of each column.
    """
    told = {'MECHANISM': mechanism, 'SHAFT': shaft.replace('position', 'encoder'),
            'COUNT': str(counts[shaft] / np.sqrt(12.0))}
    for name, value in told.items():
        text = text.replace(name, value)
    return text


def counted(shaft: str, counts: Mapping[str, float], angles: Iterable[np.ndarray]) -> np.ndarray:
    """Return the angle of a shaft as its encoder counts it; ``angles`` are in their order."""
    count, angle = counts[shaft], dict(zip(counts, angles, strict=True))[shaft]
    return np.floor(angle / count + 0.5) * count
