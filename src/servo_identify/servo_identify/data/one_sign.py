r"""
A current of one sign: asked about by its range, and told by the equation of the drive.

.. math:: K_v u = c + R\,s\,|i| + k_e\,\omega, \qquad s = \mathrm{sgn}(K_v u - k_e\,\omega)

Where s closes it much better than s = 1 does, |i| stands in the place of i.
"""

from __future__ import annotations

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .drive_equation import drive_equation
from .finding import Finding
from .likelihood import SAMPLES
from .mistakes import MISTAKE
from .signals import signals
from .survey import Survey
from .told_by_another import ONE_SIGN

WIDTH = 3.0  # samples: of a Gaussian that leaves the current its changes of sign


def sign_findings(one: Survey) -> list[Finding]:
    """Return what the ranges of command and current say of where they were measured."""
    (lowest, highest), (least, most) = one.command, one.current
    if not {'voltage', 'current'} <= one.measured:
        return []
    if least == most and lowest < highest:
        return [Finding('red', f'{one.name}: the current is {least:g} A in all samples while the '
                        'command changes: nothing was measured.',
                        'look at the sensor, or leave the column out')]
    little = ONE_SIGN * (highest - lowest)
    if lowest < -little < little < highest and _of_one_sign(least, most):
        return [Finding('amber', f'{one.name}: the current never changes its sign while the '
                        'command does: is it a magnitude, or that of the supply?',
                        'record the current of the motor with its sign')]
    return []


def magnitude_findings(one: Recording, servo: Servo, sure: float) -> list[Finding]:
    """
    Return that a current is a magnitude, if the equation of the drive surely shows it.

    ``sure``, nats, is by how much the equation must close better with the sign, its rarity
    counted.
    """
    if not one.has('current') or not _of_one_sign(
            float(np.nanmin(one['current'])), float(np.nanmax(one['current']))):
        return []
    at = signals(one, WIDTH)
    own = drive_equation(at, servo) if at is not None else None
    if own is None:
        return []
    told, current, speed = own.parts()
    sign = np.sign(told - speed)

    def left(column: np.ndarray) -> float:
        columns = np.stack([column, speed, np.ones_like(speed)], 1)
        return float(np.sum((told - columns @ np.linalg.lstsq(columns, told, rcond=1e-9)[0])**2))

    as_it_is, signed = left(current), left(sign * np.abs(current))
    floor = 1e-6 * float(np.sum(told**2))  # no drive follows its equation better
    nats = 0.5 * SAMPLES * np.log((as_it_is + floor) / (signed + floor)) if floor else 0.0
    if not nats > sure + MISTAKE:
        return []
    return [Finding('red', f'{one.name}: with the sign that command and speed ask for the current '
                    f'closes {100.0 * (1.0 - signed / as_it_is):.0f} % of the equation of the '
                    'drive that is open without: it is a magnitude, or that of the supply.',
                    'record the current of the motor with its sign, or leave it out: '
                    '--column current= of init', one.name)]


def _of_one_sign(least: float, most: float) -> bool:
    """Tell whether the range of a current ends at zero, but for noise."""
    return min(abs(least), abs(most)) < ONE_SIGN * (most - least)
