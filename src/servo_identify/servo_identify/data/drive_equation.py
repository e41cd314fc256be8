r"""
The equation of a drive between its command, its current and the speed of its motor.

.. math:: K_v u = R\,i + k_e\,\omega
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from servo_twin.physics.servo import Servo

from .signals import motor_side, Signals


@dataclass(frozen=True)
class DriveEquation:
    """
    The equation of a drive: ``told`` = ``ohms`` times ``current`` + ``per_speed`` times ``speed``.

    In V of a drive of voltages; of a drive of currents in A, where ``ohms`` is 1 and ``per_speed``
    0. The columns have the shape (samples,). No limit of the drive cuts ``told``.
    """

    told: np.ndarray
    current: np.ndarray
    speed: np.ndarray
    ohms: float
    per_speed: float

    def parts(self) -> np.ndarray:
        """Return command, current and speed as they stand in it, (3, samples)."""
        return np.stack([self.told, self.ohms * self.current, self.per_speed * self.speed])


def drive_equation(at: Signals, servo: Servo) -> DriveEquation | None:
    """Return the equation of the drive; None where it has none, or a channel is not there."""
    values, plain, kind = servo.values, at.plain, servo.drive.name
    side = motor_side(at, values['mechanism.ratio'])
    if side is None or not {'voltage', 'current'} <= plain.keys() or kind not in (
            'voltage_drive', 'current_drive', 'current_amplifier'):
        return None
    ohms, per_speed = (values['drive.resistance'], values['drive.back_emf']) if (
        kind == 'voltage_drive') else (1.0, 0.0)
    return DriveEquation(values['drive.gain'] * plain['voltage'], plain['current'],
                         side[1] * at.speed[side[0]], ohms, per_speed)
