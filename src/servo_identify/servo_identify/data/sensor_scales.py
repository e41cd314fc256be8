"""
Torque sensor and reference speed of a recording, held against the motor.

The torque on the load follows the motor's torque times the ratio, and a loop that works follows
its reference. Both are compared where they move together; a factor is named only where it is that
of a known mistake.
"""

from __future__ import annotations

from math import pi

import numpy as np
from scipy.ndimage import gaussian_filter1d

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .finding import Finding

TOGETHER = 0.9  # correlation from which on two signals count as the same
NEAR = 0.25  # of the logarithm of a factor, within which it is a known one
WIDTH = 8.0  # samples, standard deviation of the Gaussian
MOST = 20_000  # samples that are looked at


def sensor_findings(one: Recording, servo: Servo) -> list[Finding]:
    """Return what is wrong with sign and scale of the torque sensor and the reference speed."""
    return [*_torque(one, servo), *_speed(one, servo)]


def _torque(one: Recording, servo: Servo) -> list[Finding]:
    if not (one.has('torque') and one.has('current')):
        return []
    ratio = servo.values['mechanism.ratio']
    motor = ratio * servo.values['drive.torque_constant'] * one['current'][:MOST]
    together, factor = _compared(one['torque'][:MOST], motor)
    if together < -TOGETHER:
        return [Finding('red', f'{one.name}: the torque sensor reads against the torque of the '
                        'motor', 'turn its sign in the mapping: negate: true')]
    if together < TOGETHER:
        return []
    for known, said in ((1e3, 'mN m'), (1e-3, 'kN m')):
        if abs(np.log(factor / known)) < NEAR:
            return [Finding('red', f'{one.name}: the torque is {factor:.3g} times that of the '
                            f'motor at the load: it is in {said}?',
                            f'give its unit in the header or the mapping: torque [{said}]')]
    return []


def _speed(one: Recording, servo: Servo) -> list[Finding]:
    name = 'load_position' if one.has('load_position') else 'motor_position'
    if not (one.has('reference_velocity') and one.has(name)):
        return []
    ratio = 1.0 if name == 'load_position' else servo.values['mechanism.ratio']
    angle = one[name][:MOST] / ratio
    speed = np.gradient(angle, one.period)
    together, factor = _compared(one['reference_velocity'][:MOST], speed)
    if together < TOGETHER:
        return []
    for known, said, where in (
            (180.0 / pi, 'the reference speed is in deg/s', 'reference_velocity [deg/s]'),
            (30.0 / pi, 'the reference speed is in rpm', 'reference_velocity [rpm]'),
            (pi / 180.0, f'{name} is in degrees', f'{name} [deg]'),
            (1e3, 'the time is in ms', 't [ms]')):
        if abs(np.log(factor / known)) < NEAR:
            return [Finding('red', f'{one.name}: the reference speed is {factor:.3g} times the '
                            f'speed of the load: {said}?',
                            f'give the unit in the header or the mapping: {where}')]
    return []


def _compared(one: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    """Return correlation and ratio of sizes of two smoothed signals; (0, 1) where they rest."""
    known = np.isfinite(one) & np.isfinite(other)
    if known.sum() < 100:
        return 0.0, 1.0
    first = gaussian_filter1d(one[known], WIDTH)
    second = gaussian_filter1d(other[known], WIDTH)
    if not (np.std(first) > 0.0 and np.std(second) > 0.0):
        return 0.0, 1.0
    return float(np.corrcoef(first, second)[0, 1]), float(np.std(first) / np.std(second))
