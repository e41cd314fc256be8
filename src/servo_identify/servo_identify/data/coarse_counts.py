"""
What the steps of an encoder's readings do to the acceleration and to the twist of a transmission.

A diagnosis smooths each motion by test functions as long as its noise asks for, up to a longest.
Steps that are coarse for that leave a torque that no machine has made, and a twist between the
two encoders that no torque has made.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .encoder_count import count_of
from .finding import Finding
from .rough_balances import rotor_of, torque_of_drive
from .signals import ANGLES, bridged, derived, MOST, Signals, signals, TURN

SPACINGS = (2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 25, 32)
"""Samples between the knots of a test function."""
LONGEST = 0.25  # s, of a test function
SMOOTH_ENOUGH = 0.005  # noise of the inertial torque, as a share of the torque at work
TWIST_SHOWN = 0.2  # twist that the steps make, as a share of that at work
_SPREAD = np.sqrt(0.5)  # standard deviation of a quintic B-spline, in spacings


def longest_spacing(period: float) -> int:
    """Return the samples between the knots of the longest test function of a diagnosis."""
    return max(SPACINGS[0], min(SPACINGS[-1], int(LONGEST / (6 * period))))


def coarse_findings(one: Recording, servo: Servo) -> list[Finding]:
    """Say of which angles the steps are coarse for this motion, however it is smoothed."""
    width = float(_SPREAD * longest_spacing(one.period))
    at = signals(one, width)
    told = torque_of_drive(at, servo) if at is not None else None
    if at is None or told is None:
        return []
    at_work, found = float(np.sqrt(np.mean(told[0]**2))), list[Finding]()
    steps = {name: step for name in ANGLES if name in at.plain
             and (step := count_of(one[name][:MOST]))}
    for name, step in steps.items():
        made = _made_by_rounding(one[name][:MOST], step, width, 2) / one.period**2
        if made * _inertia(name, at, servo) > SMOOTH_ENOUGH * at_work:
            share = made / max(float(np.std(at.acceleration[name])), made)
            found.append(Finding(
                'amber', f'{one.name}: {name} comes in steps of {_written(step, name, servo)}, '
                f'coarse for this motion: they make {_percent(share)} of the acceleration, and '
                f'a torque of {_percent(made * _inertia(name, at, servo) / at_work)} of that at '
                'work, under the longest test function. Effects of that size are hidden.',
                'record the counts of the encoder or more decimals; else move faster, or take '
                'an encoder with more counts', one.name))
    return found + _twist_findings(one, servo, at, steps, at_work)


def _twist_findings(one: Recording, servo: Servo, at: Signals, steps: Mapping[str, float],
                    at_work: float) -> list[Finding]:
    """Say whether the steps hide the twist that the torque at work, N m at the motor, makes."""
    stiffness = servo.values.get('mechanism.stiffness', 0.0)
    if not stiffness > 0.0 or not all(name in at.plain for name in ANGLES):
        return []
    ratio = servo.values['mechanism.ratio']
    made = {name: _made_by_rounding(one[name][:MOST], step, at.width, 0)
            / (ratio if name == 'motor_position' else 1.0) for name, step in steps.items()}
    twist, whole = at_work * ratio / stiffness, float(np.hypot.reduce([0.0, *made.values()]))
    if whole <= TWIST_SHOWN * twist:
        return []
    name = max(made, key=made.__getitem__)
    unit = 'mm' if servo.straight('load_position') else 'mrad'
    return [Finding(
        'amber', f'{one.name}: {name} comes in steps of {_written(steps[name], name, servo)}, '
        f'coarse for the twist between the encoders: they make {1e3 * whole:.3g} {unit} of it, '
        f'and the torque at work twists by {1e3 * twist:.3g} {unit}, under the longest test '
        'function. Stiffness, damping, backlash and kinematic error of that size are hidden.',
        'record the counts of the encoder or more decimals; of a diagnosis take what it says of '
        'motor and load, and nothing smaller than that of the transmission', one.name)]


def _made_by_rounding(x: np.ndarray, step: float, width: float, order: int) -> float:
    """
    Return the standard deviation that rounding makes of a derivative, per sample to the order.

    Where a reading steps, the angle is known: half way. A smooth motion through these places is
    rounded again, and what that changes passes the Gaussian of the diagnosis.
    """
    x = bridged(x)
    at = np.flatnonzero(np.diff(x))
    rows = np.arange(len(x))
    between = np.interp(rows, at + 0.5, (x[at] + x[at + 1]) / 2.0)
    motion = derived(between, width, 0)
    edge = int(4 * width)
    off = derived(np.round(motion / step) * step - motion, width, order)
    return float(np.std(off[edge:len(off) - edge]))


def _inertia(name: str, at: Signals, servo: Servo) -> float:
    """Return the torque at the motor's shaft that 1 rad/s2 of an angle makes, N m s2/rad."""
    ratio = servo.values['mechanism.ratio']
    rotor, load = rotor_of(servo), servo.values['mechanism.load_inertia'] / ratio**2
    both = all(angle in at.plain for angle in ANGLES)
    if name == 'motor_position':
        return rotor + (0.0 if both else load)
    return ratio * (load + (0.0 if both else rotor))


def _percent(share: float) -> str:
    return f'{100.0 * share:.{0 if share > 0.1 else 1}f} %'


def _written(step: float, name: str, servo: Servo) -> str:
    """Return a step with its unit."""
    if servo.straight(name):
        return f'{1e3 * step:.3g} mm'
    return f'{360.0 * step / TURN:.3g} deg ({TURN / step:.4g} a turn)'
