"""
What a mesh does between a shaft that is measured and one that is not.

With one encoder a torque balance needs the other shaft all the same: a load that swings on its
mesh, or stands while the motor winds it up, is no friction and no inertia. The twin knows, pulled
to the shaft that is measured.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import maximum_filter1d

from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import OUTPUTS
from servo_twin.recording.recording import Recording

if TYPE_CHECKING:
    from .balance import Balance

TRUSTED = 0.7  # share of the twin's swing that is taken to be that of the rig
WITHIN = 0.25  # s by which the rig may swing earlier or later


def wound_up(recording: Recording, servo: Servo) -> np.ndarray:
    """
    Return the wind-up by the twin, rad, shape (samples,), where one shaft is measured; else zero.

    The zero of the wind-up is the one that carries no torque.
    """
    has = {name: recording.has(f'{name}_position') for name in ('motor', 'load')}
    nothing = np.zeros(len(recording))
    if all(has.values()) or not any(has.values()) or not (
            servo.mechanism.compliant and servo.mechanism.correctable):
        return nothing
    first = {name: float(recording[f'{name}_position'][0]) for name in has if has[name]}
    y = simulate(servo, inputs_of(recording.columns), recording.period,
                 initial_state(servo, **first), 'observer')
    motor, load = (y[:, OUTPUTS.index(f'{name}_position')] for name in ('motor', 'load'))
    wound = motor / servo.values['mechanism.ratio'] - load
    return wound if np.isfinite(wound).all() else nothing


def swing(balance: Balance, name: str) -> np.ndarray:
    """Return at the centres how far a balance of torques may be off by the wind-up, N m."""
    seen, values = balance.seen, balance.servo.values
    unseen, ratio = 'load' if seen.has('motor') else 'motor', values['mechanism.ratio']
    if not seen.channels.wound.any() or name not in ('torque', unseen):
        return np.zeros(len(balance.times(name)))
    inertia = values['mechanism.load_inertia'] if unseen == 'load' else (
        values['mechanism.rotor_inertia'] * (ratio if name == 'motor' else ratio**2))
    torque = np.abs(inertia * seen.bump.weigh(seen.channels.wound, 2))
    apart = round(0.5 * WITHIN / (seen.bump.stride * seen.period))
    return (1.0 - TRUSTED) * maximum_filter1d(torque, 1 + 2 * apart)
