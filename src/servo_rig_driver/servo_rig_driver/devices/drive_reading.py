"""What one drive that is asked for each sample has told last, and the row of columns it makes."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan, nan

from ..driver.sample_blocks import COLUMNS


@dataclass
class Reading:
    """What a drive has told last: rad at the motor, rad/s at the load, A and degC; NaN: not."""

    motor_position: float = nan
    load_speed: float = nan
    current: float = nan
    current_reference: float = nan
    temperature: float = nan

    def row(self) -> list[float]:
        """
        Return what was read by COLUMNS.

        The command that a drive received, ``voltage``, is its current reference: one volt is one
        ampere (drive.gain = 1 A/V in a servo file). One that does not tell it follows it at once.
        """
        row = [nan] * len(COLUMNS)
        row[MOTOR], row[_CURRENT], row[_WANTED], row[_TEMPERATURE] = (
            self.motor_position, self.current, self.current_reference, self.temperature)
        row[_VOLTAGE] = self.current if isnan(self.current_reference) else self.current_reference
        return row


MOTOR, _CURRENT, _WANTED, _TEMPERATURE, _VOLTAGE = (COLUMNS.index(name) for name in (
    'motor_position', 'current', 'current_reference', 'temperature', 'voltage'))
