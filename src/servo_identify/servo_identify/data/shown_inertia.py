"""The inertia that recordings show, held against that of the servo file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .excitation import Excitation
from .finding import Finding
from .mistakes import TURN

NEAR = 0.25  # of a logarithm, within which a factor is worth a question
NO_SERVO_FILE = 100.0  # a factor on the inertia by which no servo file is wrong
SHARE = 0.3  # of the torque that acceleration must explain before its inertia is believed


def inertia_findings(recordings: Sequence[Recording], shown: Sequence[Excitation | None],
                     servo: Servo) -> list[Finding]:
    """
    Return which recordings show another inertia than the servo file.

    ``shown`` is what each excites. None does where that which shows the inertia best has it right.
    """
    best = max((found for found in shown if found), key=_accelerated, default=None)
    return [finding for one, found in zip(recordings, shown, strict=True)
            if found and best and _far(best) for finding in _far_off(one, found, servo)]


def _accelerated(found: Excitation) -> float:
    """Return the share of the torque that acceleration explains."""
    return found.share.get('inertia', 0.0)


def _far(found: Excitation) -> bool:
    return found.inertia > 4.0 or 0.0 < found.inertia < 0.25


def _far_off(one: Recording, found: Excitation, servo: Servo) -> list[Finding]:
    """Return that a recording shows another inertia; where one shows it better, that decides."""
    if _accelerated(found) < SHARE or not _far(found):
        return []
    known = {'the angle is that of the other shaft?': servo.values['mechanism.ratio'],
             'the angle is in turns?': TURN}
    if found.inertia > 1.0:
        known['command and current are in thousandths (mV and mA)?'] = 1e3
    near = [f' That is near {factor:.4g}: {what}' for what, factor in known.items()
            if abs(abs(np.log(found.inertia)) - abs(np.log(factor))) < NEAR]
    level = 'red' if abs(np.log(found.inertia)) > np.log(NO_SERVO_FILE) else 'amber'
    return [Finding(level, f'{one.name}: the recording shows {found.inertia:.3g} times the '
                    'inertia of the servo file.' + ''.join(near), 'look at inertias, ratio, '
                    'torque constant, and at the units of command and angle', one.name)]
