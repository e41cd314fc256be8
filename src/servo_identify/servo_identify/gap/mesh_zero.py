"""
Where the wind-up of a mesh with play or a bent spring is zero, and what hangs on it.

The encoders do not tell: their zeros are anywhere. Of a straight spring it does not matter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from servo_twin.physics.following import FOLLOWED, MOTION
from servo_twin.physics.simulate import initial_state
from servo_twin.physics.state import ZERO

if TYPE_CHECKING:
    from .balance import Balance

WIND_UP, WIND_UP_RATE = MOTION.index('wind_up'), MOTION.index('wind_up_rate')
SLOW = 0.02  # of the highest speed, below which a shaft may stand and friction says nothing
ZERO_STEP = 0.002  # share of the range of the wind-up by which its zero is tried


def zero_of(balance: Balance) -> float:
    """
    Find the zero of the wind-up beside its median, rad: the one that explains the torque best.

    A gap or a bent spring is not the same from another zero; a straight one does not care. A
    torque that is not measured is the one that the load asks for, told while it moves. Of a
    recording that never leaves one flank the zero is as far away as the largest torque winds up.
    """
    theta, on = balance.about, balance.base_switches
    span = float(np.ptp(np.percentile(balance.motion('wind_up'), (2, 98))))
    rows = balance.meshed.rows[:: max(1, len(balance.meshed.rows) // 4000)].copy()
    wound, told = rows[:, WIND_UP].copy(), slice(None)
    if not balance.seen.has('torque'):
        speed = np.abs(rows[:, MOTION.index('load_speed')])
        told = speed > SLOW * np.percentile(speed, 98)

    def torques(shift):
        rows[:, WIND_UP] = wound - shift
        out = balance.follow(theta, on, rows)[told]
        return out[:, FOLLOWED.index('mesh_torque')], out[:, FOLLOWED.index('torque')]

    def misfit(shift):
        pull, torque = torques(shift)
        return float(np.mean(np.abs(pull - torque)))

    most = float(np.percentile(np.abs(torques(0.0)[1]), 98))
    farthest = -initial_state(balance.servo, 0.0, 0.0, most, theta=theta, on=on)[ZERO]
    best, width = 0.0, 0.5 * span + farthest
    for _ in range(5):
        tried = best + np.linspace(-width, width, 11)
        best, width = float(tried[np.argmin([misfit(t) for t in tried])]), 0.2 * width
    return best


def slope_of_zero(balance: Balance) -> np.ndarray:
    """
    Return at the centres what the transmission's residual gains by one rad of its zero.

    One for a linear mesh. Inside a gap nothing is wound up, wherever the zero is.
    """
    stiffness = balance.servo.values.get('mechanism.stiffness')
    if not stiffness or not balance.has_gap:
        return np.ones(len(balance.times('transmission')))
    rows, theta = balance.meshed.rows.copy(), balance.about
    shift = ZERO_STEP * float(np.ptp(rows[:, WIND_UP]))
    rows[:, WIND_UP] += shift
    pull = balance.follow(theta, balance.base_switches, rows)[:, 4]
    rows[:, WIND_UP] -= 2.0 * shift
    pull -= balance.follow(theta, balance.base_switches, rows)[:, 4]
    return balance.under(pull, balance.seen.mesh) / (2.0 * shift * stiffness)


def kinks(balance: Balance) -> np.ndarray:
    """
    Return at the centres by how much a bent mesh law is blurred by the bump, rad.

    The law of the mean wind-up is not the mean of the law where the wind-up runs through a
    kink within the bump; there the balance knows no better. Zero for a linear mesh.
    """
    stiffness = balance.servo.values.get('mechanism.stiffness')
    if not stiffness or not balance.has_gap:
        return np.zeros(len(balance.times('transmission')))
    rows, theta = balance.meshed.rows, balance.about
    damping = balance.value(theta, 'mechanism.damping')
    bent = balance.follow(theta, balance.base_switches, rows)[:, 4] - stiffness * rows[:, WIND_UP]
    bent -= damping * rows[:, WIND_UP_RATE]
    bump, reach = balance.seen.mesh, balance.seen.mesh.reach
    at = np.clip(bump.centres(len(balance.seen.recording)) - reach, 0, len(bent) - 1)
    return np.abs(np.nan_to_num(balance.under(bent, bump) - bent[at])) / stiffness
