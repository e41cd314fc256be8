"""
The inertia that recordings show, held against that of the servo file.

Where a motion reverses, friction changes its sign while the shaft accelerates: what looks like
inertia may be friction that rises with the way or falls with the speed. So the inertia must also
show where the shaft turns clearly one way, beside a friction of any form over the speed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .excitation import Excitation, plain_terms
from .finding import Finding
from .pooled import Columns, pooled
from .rough_balances import inertia_of
from .shown_drift import FORMS
from .shown_parting import TURNING
from .signals import TURN

NEAR = 0.25  # of a logarithm, within which a factor is worth a question
NO_SERVO_FILE = 100.0  # a factor on the inertia by which no servo file is wrong
SHARE = 0.75  # of the squares: acceleration must halve what other terms leave of the torque


def inertia_findings(recordings: Sequence[Recording], shown: Sequence[Excitation | None],
                     servo: Servo) -> list[Finding]:
    """
    Return which recordings show another inertia than the servo file.

    ``shown`` is what each excites. None does where that which shows the inertia best has it right.
    """
    best = max((found for found in shown if found), key=_accelerated, default=None)
    return [finding for one, found in zip(recordings, shown, strict=True)
            if found and best and _far(best.inertia) for finding in _far_off(one, found, servo)]


def _accelerated(found: Excitation) -> float:
    """Return the share of the torque that acceleration explains."""
    return found.share.get('inertia', 0.0)


def _far(inertia: float) -> bool:
    return inertia > 4.0 or 0.0 < inertia < 0.25


def _between_reversals(found: Excitation, servo: Servo) -> float:
    """Return the inertia over the file's where the shaft turns one way; else as it was found."""
    told = plain_terms(found.signals, servo)
    if told is None or not {'viscous friction', 'Coulomb friction'} <= told[1].keys():
        return found.inertia
    torque, terms = told
    speed, sign = terms['viscous friction'], terms['Coulomb friction']
    rows = np.abs(sign) > TURNING
    columns = np.stack([*terms.values(), *(sign * np.abs(speed)**power for power in FORMS)], 1)
    if rows.sum() <= columns.shape[1]:
        return found.inertia
    fit = pooled([Columns(torque[rows], columns[rows], np.empty((int(rows.sum()), 0)))])
    return (float(fit.shared[0]) / inertia_of(servo) if np.isfinite(fit.covariance[0, 0])
            else found.inertia)


def _far_off(one: Recording, found: Excitation, servo: Servo) -> list[Finding]:
    """Return that a recording shows another inertia; where one shows it better, that decides."""
    if _accelerated(found) < SHARE or not _far(found.inertia) or not _far(
            _between_reversals(found, servo)):
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
