"""The compliance that a rigid servo lacks, as values of two inertias."""

from __future__ import annotations

import numpy as np

from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.servo import Servo, Value

from .curves import Part

FINE_STEP = 0.2  # of the time in which a spring swings by one radian
SHORTEST_STEP = 1e-6  # s
BOUNCE = 0.2  # share of critical damping of teeth that meet: of steel with oil

Compliance = tuple[dict[str, Value], float]
"""Stiffness and damping of the transmission, by path; the step that carries them, s."""


def sprung(servo: Servo, part: Part, relaxation: float | None = None,
           stiffness: float = 0.0) -> Compliance:
    r"""
    Return the compliance of a part that lets the transmission twist.

    .. math:: w + \tau\,\dot w = c\,T, \quad K = 1/c, \quad D = \tau/c

    ``relaxation`` is the time
    :math:`\tau`, s, where it is not the second amplitude over the first; ``stiffness`` that which
    was searched; 0: it is the one of the amplitude.
    """
    amplitudes = part.amplitudes
    if part.curve is not None:  # a curve over torque or acceleration: its slope, the compliance
        inertia = servo.numbers['mechanism.load_inertia']
        torque = inertia if part.curve.variable == 'acceleration' else 1.0
        amplitudes = np.array([abs(part.curve.slope() / torque), 0.0])
    if relaxation is None:
        relaxation = float(amplitudes[1]) / amplitudes[0] if len(amplitudes) > 1 and (
            amplitudes[0] > 0.0) else 0.0
    return _two_inertias(servo, stiffness or 1.0 / max(amplitudes[0], 1e-12), relaxation)


def met(servo: Servo, frequency: float) -> Compliance:
    """Return the compliance of teeth on which the load swings with ``frequency``, Hz."""
    natural = 2.0 * np.pi * frequency
    return _two_inertias(servo, servo.numbers['mechanism.load_inertia'] * natural**2,
                         2.0 * BOUNCE / natural)


def _two_inertias(servo: Servo, stiffness: float, relaxation: float) -> Compliance:
    bounds = {n: TwoInertia.parameters[n].bounds for n in ('stiffness', 'damping')}
    stiffness = float(np.clip(stiffness, *bounds['stiffness']))
    damping = float(np.clip(relaxation * stiffness, *bounds['damping']))
    rotor, load = (max(servo.numbers[f'mechanism.{n}_inertia'], 1e-9)
                   for n in ('rotor', 'load'))
    ratio = servo.numbers['mechanism.ratio']
    rate = np.sqrt(stiffness * (1.0 / (rotor * ratio**2) + 1.0 / load))  # rad/s
    step = FINE_STEP / max(rate, relaxation * rate**2)
    step = min(servo.step, max(SHORTEST_STEP, float(f'{step:.1g}')))
    return {'mechanism.stiffness': stiffness, 'mechanism.damping': damping}, step
