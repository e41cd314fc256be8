"""The command of a drive that takes a current, where only the set-point of the current is told."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from servo_twin.physics.servo import Servo

from .column_units import takes_current


def with_command(columns: Mapping[str, np.ndarray], servo: Servo | None, told: list[str]
                 ) -> dict[str, np.ndarray]:
    """
    Return columns (samples,) with ``voltage``, the command, where the set-point tells it.

    A drive that takes a current makes ``gain`` times its command the set-point of its loop,
    ``current_reference``, A. ``told`` gets a sentence of it. Columns with a command, and those of
    another drive, stay as they are.
    """
    columns = dict(columns)
    reference = columns.get('current_reference')
    if reference is None or 'voltage' in columns or servo is None or not takes_current(servo):
        return columns
    gain = servo.numbers['drive.gain']
    if gain != 0.0 and np.isfinite(reference).any():
        columns['voltage'] = reference / gain
        told.append('there is no voltage, the command that the drive received: current_reference '
                    f'over the gain of the drive, {gain:g} A/V, is taken for it')
    return columns
