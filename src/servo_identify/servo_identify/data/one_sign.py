r"""
A current or command of one sign: asked about by its range, told by the equation of the drive.

.. math:: K_v u = c + R\,s\,|i| + k_e\,\omega, \qquad s = \mathrm{sgn}(K_v u - k_e\,\omega)

Where s closes it much better than s = 1 does, |i| stands in the place of i. A command is taken the
same way, with the sign of what current and speed make of it: a PWM whose direction is elsewhere.
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
_WITH_SIGN = {
    'current': ('command and speed', 'current', 'record the current of the motor with its sign, '
                'or leave it out: --column current= of init'),
    'voltage': ('current and speed', 'command', 'give it the sign that the direction of the '
                'bridge has, in a column of your own, such as pwm * (2 * dir - 1)')}
"""Channels of one sign: what asks for another one, what they are called, and what to do."""


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
    Return that current or command is a magnitude, if the equation of the drive surely shows it.

    ``sure``, nats, is by how much the equation must close better with the sign, its rarity
    counted.
    """
    suspects = [name for name in _WITH_SIGN if one.has(name) and _of_one_sign(
        float(np.nanmin(one[name])), float(np.nanmax(one[name])))]
    at = signals(one, WIDTH) if suspects else None
    own = drive_equation(at, servo) if at is not None else None
    if own is None:
        return []
    told, current, speed = own.parts()
    signed = {'current': (told, np.sign(told - speed) * np.abs(current)),
              'voltage': (np.sign(current + speed) * np.abs(told), current)}
    found = []
    for name in suspects:
        as_it_is, closed = _left(told, current, speed), _left(*signed[name], speed)
        floor = 1e-6 * float(np.sum(told**2))  # no drive follows its equation better
        nats = 0.5 * SAMPLES * np.log((as_it_is + floor) / (closed + floor)) if floor else 0.0
        if nats > sure + MISTAKE:
            asking, what, action = _WITH_SIGN[name]
            found.append(Finding(
                'red', f'{one.name}: with the sign that {asking} ask for the {what} closes '
                f'{100.0 * (1.0 - closed / as_it_is):.0f} % of the equation of the drive that is '
                'open without: it is a magnitude, or that of the supply.', action, one.name))
    return found


def _left(told: np.ndarray, current: np.ndarray, speed: np.ndarray) -> float:
    """Return the sum of squares that current, speed and a constant leave of a command."""
    columns = np.stack([current, speed, np.ones_like(speed)], 1)
    return float(np.sum((told - columns @ np.linalg.lstsq(columns, told, rcond=1e-9)[0])**2))


def _of_one_sign(least: float, most: float) -> bool:
    """Tell whether the range of a current ends at zero, but for noise."""
    return min(abs(least), abs(most)) < ONE_SIGN * (most - least)
