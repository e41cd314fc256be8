r"""
The spring that a rigid twin lacks.

A rigid mechanism has no stiffness that could be off; what it leaves out is the compliance `c`
(rad at the load for a torque of one) of a mesh with the relaxation time `tau`, at whose value zero
it is rigid:

.. math:: w + \tau\,\dot w = c\,T, \quad K = 1/c, \quad D = \tau/c

with the wind-up `w` and the torque `T` on the load. Both are linear in the balance of the
transmission, and along the measured motion nothing stiff is integrated. They stand behind the
values of the servo in theta, where no kernel looks; a twin that bends runs as `two_inertia`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import sqrt

import numpy as np

from servo_twin.physics.effect import Parameter
from servo_twin.physics.mechanisms.rigid import Rigid
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.servo import Servo

COMPLIANCE, RELAXATION = 'mechanism.compliance', 'mechanism.relaxation'
STIFFNESS, DAMPING = 'mechanism.stiffness', 'mechanism.damping'
NAME = 'stiffness_error'
SPRING = {
    COMPLIANCE: Parameter(0.0, 'rad/(N m)', (0.0, 1e3), 'Wind-up for a torque of one.', off=0.0),
    RELAXATION: Parameter(0.0, 's', (0.0, 10.0), 'Damping over stiffness of the mesh.', off=0.0),
}
INERTIAS = ('mechanism.rotor_inertia', 'mechanism.load_inertia')
FINE_STEP = 0.2  # of the time in which the spring swings by one radian
SHORTEST_STEP = 1e-6  # s


def may_bend(servo: Servo, channels: Iterable[str]) -> bool:
    """Tell whether a spring is missing in a servo and would show in these channels."""
    return (servo.mechanism is Rigid and {'motor_position', 'load_position'} <= set(channels)
            and all(servo.values[path] >= 1e-9 for path in INERTIAS))


def running(servo: Servo, theta: np.ndarray) -> tuple[Servo, np.ndarray]:
    """Return (servo, theta) of the twin to run: two inertias where there is a spring."""
    size = len(servo.theta)
    if len(theta) == size:
        return servo, theta
    theta, (compliance, relaxation) = theta[:size], theta[size:]
    if compliance <= 0.0:
        return servo, theta
    bent = _sprung(servo, float(compliance), float(relaxation))
    flat, there = bent.theta, bent.slots()
    for path, slot in servo.slots().items():
        flat[there[path]] = theta[slot]
    return bent, flat


def sprung(servo: Servo, theta: np.ndarray) -> Servo:
    """Return a rigid servo as two inertias with the spring that stands behind its theta."""
    compliance, relaxation = theta[-2:]
    return _sprung(servo, float(compliance), float(relaxation))


def spring_values(servo: Servo, theta: np.ndarray, std: Iterable[float]) -> dict[str, dict]:
    """
    Return stiffness and damping by path as a report has them: value, std and unit.

    ``std`` are the standard deviations of compliance (rad/(N m)) and relaxation time (s).
    """
    compliance, relaxation = theta[-2:]
    of_compliance, of_relaxation = std
    found = {STIFFNESS: (1.0 / compliance, of_compliance / compliance**2),
             DAMPING: (relaxation / compliance, of_relaxation / compliance)}
    linear = servo.linear
    units = {STIFFNESS: 'N/m' if linear else 'N m/rad',
             DAMPING: 'N s/m' if linear else 'N m s/rad'}
    return {path: {'value': float(value), 'std': float(off), 'unit': units[path]}
            for path, (value, off) in found.items()}


def _sprung(servo: Servo, compliance: float, relaxation: float) -> Servo:
    """Two inertias of the same values; the step resolves how the spring swings and dies away."""
    low, high = TwoInertia.parameters['stiffness'].bounds
    stiffness = min(max(1.0 / compliance, low), high)
    damping = min(relaxation * stiffness, TwoInertia.parameters['damping'].bounds[1])
    rotor, load = (servo.values[path] for path in INERTIAS)  # as given: the step has room
    ratio = servo.values['mechanism.ratio']
    rate = sqrt(stiffness * (1.0 / (rotor * ratio**2) + 1.0 / load))  # rad/s
    step = FINE_STEP / max(rate, relaxation * rate**2)
    step = min(servo.step, max(SHORTEST_STEP, float(f'{step:.1g}')))
    return replace(servo, mechanism=TwoInertia, step=step,
                   values={**servo.values, STIFFNESS: stiffness, DAMPING: damping})
