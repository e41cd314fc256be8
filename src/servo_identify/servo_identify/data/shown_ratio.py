r"""
The ratio that two encoders show, held against that of the servo file.

.. math:: \theta_m / N - \theta_l = s\,\theta_l + a\,\ddot\theta_l + b\,\dot\theta_l
          + c\,\mathrm{sgn}\,\dot\theta_l + d\,T + e(\theta_l) + z

Twist, backlash and, of a load that turns once around, eccentric encoders have their own terms, so
that s is what a ratio of N (1 + s) leaves. T is the torque of the drive, where it is known: a
spring at the load twists the transmission in proportion to the angle. Where the motion does not
tell the angle from the twist, as one sine, nothing is said. Nor is it where s makes up for less
over the whole motion than what comes and goes, which is never all in the terms: torsion, backlash
and hysteresis.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from servo_twin.physics.servo import Servo

from .finding import Finding
from .mistakes import MISTAKE
from .pooled import Columns, pooled
from .rough_balances import torque_of_drive
from .shown_parting import torsion_of
from .signals import ANGLES, Signals, TURN

RATIO = 'mechanism.ratio'
FORM = 0.1  # of a channel, by which one that is alike differs
BELT = 0.005
"""How far a belt or a friction drive may be off the ratio of its diameters, as a share."""


def ratio_findings(seen: Sequence[Signals], servo: Servo, sure: float) -> list[Finding]:
    """
    Return that the encoders show a ratio beyond the tolerance of the file, if they surely do.

    ``sure``, nats, is by how much it must beat the file's, its rarity counted.
    """
    ratio = servo.values[RATIO]
    both = [at for at in seen if {*ANGLES} <= at.plain.keys()]
    if not both:
        return []
    around = not servo.linear and max(np.ptp(at.plain['load_position']) for at in both) > TURN
    torques = [torque_of_drive(at, servo) for at in both]
    known = all(one is not None for one in torques)
    columns = [_columns(at, ratio, around, one if known else None)
               for at, one in zip(both, torques, strict=True)]
    if _alike(columns):
        return []
    found = pooled(columns)
    if not any(_beyond_twist(at, float(found.shared[0]), servo) for at in both):
        return []
    shown = ratio * (1.0 + found.shared[0])
    error = ratio * float(np.sqrt(found.covariance[0, 0]))
    low, high = servo.tolerance.get(RATIO, (ratio * (1.0 - BELT), ratio * (1.0 + BELT)))
    beyond = max(low - shown, shown - high, 0.0)
    if not beyond or not 0.5 * (beyond / max(error, 1e-300))**2 > sure + MISTAKE:
        return []
    within = (f'its tolerance is {low:.6g} to {high:.6g}' if RATIO in servo.tolerance else
              'without a tolerance it counts as exact')
    return [Finding('amber', f'The two encoders show a ratio of {shown:.5g} +- {error:.1g}, and '
                    f'{RATIO} is {ratio:.6g}: {100.0 * (shown / ratio - 1.0):+.2g} %; {within}.',
                    f'count the teeth and correct {RATIO}, or the unit of the encoder that is off '
                    '(its counts a turn); a belt or a friction drive needs a tolerance')]


def _columns(at: Signals, ratio: float, around: bool,
             driven: tuple[np.ndarray, float] | None) -> Columns:
    load, name = at.plain['load_position'], 'load_position'
    shared = [load, at.acceleration[name], at.speed[name], at.sign[name]]
    if driven is not None:
        shared.append(driven[0])
    if around:
        shared += [np.cos(load), np.sin(load)]
    return Columns(at.plain['motor_position'] / ratio - load, np.stack(shared, 1),
                   np.ones((len(at), 1)))


def _beyond_twist(at: Signals, share: float, servo: Servo) -> bool:
    """Tell whether a ratio that is off by a share parts the angles further than twist may."""
    load = at.plain['load_position']
    rest = at.plain['motor_position'] / servo.values[RATIO] - (1.0 + share) * load
    return bool(abs(share) * np.ptp(load) > np.ptp(rest) + 2.0 * torsion_of(at, servo))


def _alike(several: Sequence[Columns]) -> bool:
    """Tell whether the angle is hardly more than what twist and backlash may look like."""
    shared = np.vstack([one.shared - one.shared.mean(axis=0) for one in several])
    shared = shared / np.maximum(np.linalg.norm(shared, axis=0), 1e-300)
    angle, others = shared[:, 0], shared[:, 1:]
    rest = angle - others @ np.linalg.lstsq(others, angle, rcond=1e-9)[0]
    return bool(np.linalg.norm(rest) < FORM)
