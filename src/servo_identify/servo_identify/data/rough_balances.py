r"""
Equations between the channels of a servo that hold whatever effects it has, and their terms.

With all values at the motor's shaft, these are

.. math::
    K_t i &= J \dot\omega + b\,\omega + c\,\mathrm{sgn}\,\omega + g(\theta) + T_e / N \\
    T &= J_l \dot\omega_l + b_l\,\omega_l + c_l\,\mathrm{sgn}\,\omega_l + g(\theta_l) + T_e \\
    K_v u &= R\,i + k_e\,\omega

and the angles, the reference and the torque sensor beside each other. Each factor of a term is
positive and known about as well as the servo file is; friction may be of any size that is left.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from servo_twin.physics.effects.relaxing_spring import RelaxingSpring
from servo_twin.physics.effects.spring_load import SpringLoad
from servo_twin.physics.effects.torque_over_angle import TorqueOverAngle
from servo_twin.physics.servo import Servo

from .drive_equation import drive_equation
from .signals import motor_side, Signals

FREE = 3.0  # of the logarithm of a friction that the servo file does not give
ABOUT = 0.5  # of the logarithm of an inertia: the data sheet of another machine of the class
GIVEN = 0.35  # of the logarithm of a resistance, a back EMF, a gain
SAME = 0.1  # of the logarithm of what is 1 where two channels tell the same
FRICTION_GIVEN = 1.5  # of the logarithm of a friction that the servo file gives
OPEN = 0.03  # share of what is seen that a missing effect may leave, squared: a friction, a spring
OPEN_WINDING = 0.0025  # the same of a winding, 5 % squared: its warmth, a dead band, a sag
EVENLY = 0.05  # share of its mean by which a speed varies that a loop holds
SPRINGS = (SpringLoad, RelaxingSpring, TorqueOverAngle)  # effects that act as a spring does


@dataclass(frozen=True)
class Term:
    """A column of shape (samples,), and its factor: centre and spread of the logarithm."""

    column: np.ndarray
    centre: float
    spread: float


@dataclass(frozen=True)
class RoughBalance:
    """
    One equation: ``seen`` is the sum of the terms and of ``free`` columns of any sign.

    ``free`` has shape (samples, n). ``spring`` is a column that a missing spring would add, or
    None. ``loop`` says that a control loop makes it true, which may not follow. ``open`` is the
    share of the squares of ``seen`` that an effect may leave which the servo file lacks.
    """

    name: str
    seen: np.ndarray
    terms: Mapping[str, Term]
    free: np.ndarray
    spring: np.ndarray | None = None
    loop: bool = False
    open: float = OPEN


def balances(at: Signals, servo: Servo) -> Iterator[RoughBalance]:
    """Yield the equations that the channels allow."""
    yield from _same_motion(at, servo)
    yield from _drive(at, servo)
    yield from _torques(at, servo)


def inertia_of(servo: Servo) -> float:
    """Return the whole inertia at the motor's shaft, kg m2."""
    values = servo.values
    return rotor_of(servo) + values['mechanism.load_inertia'] / values['mechanism.ratio']**2


def rotor_of(servo: Servo) -> float:
    """Return the inertia that turns with the motor, kg m2."""
    return sum(servo.values.get(f'mechanism.{name}_inertia', 0.0)
               for name in ('rotor', 'coupling', 'screw'))


def torque_of_drive(at: Signals, servo: Servo) -> tuple[np.ndarray, float] | None:
    """
    Return the motor's torque, N m, and what of it the back EMF takes away, N m s/rad.

    By the current, else by what the drive makes of the command; None where neither tells it. Nor
    does a current of a drive that is off: a smaller angle would close a balance without torque.
    """
    values = servo.values
    constant = values['drive.torque_constant']
    if 'current' in at.silent:
        return None
    if 'current' in at.plain:
        return constant * at.plain['current'], 0.0
    command = at.plain.get('voltage')
    if command is None or servo.drive.name not in ('current_drive', 'voltage_drive',
                                                   'current_amplifier'):
        return None
    if servo.drive.name == 'voltage_drive':
        ohms = values['drive.resistance']
        return (constant * values['drive.gain'] / ohms * command,
                constant * values['drive.back_emf'] / ohms)
    return constant * _wanted(command, servo), 0.0


def _wanted(command: np.ndarray, servo: Servo) -> np.ndarray:
    """Return the current that a drive of currents is told, A."""
    limit = servo.values.get('drive.current_limit', np.inf)
    return np.clip(servo.values['drive.gain'] * command, -limit, limit)


def _same_motion(at: Signals, servo: Servo) -> Iterator[RoughBalance]:
    ratio = servo.values['mechanism.ratio']
    plain = at.plain
    one = np.ones((len(at), 1))
    if 'motor_position' in plain and 'load_position' in plain:
        yield RoughBalance('angles', plain['motor_position'] / ratio,
                           {'angle': Term(plain['load_position'], 1.0, SAME / 3)}, one)
    side = 'load_position' if 'load_position' in plain else 'motor_position'
    if side not in plain:
        return
    per = 1.0 if side == 'load_position' else 1.0 / ratio
    if 'reference_position' in plain:
        yield RoughBalance('reference', plain[side] * per,
                           {'angle': Term(plain['reference_position'], 1.0, SAME)}, one,
                           loop=True)
    if 'reference_velocity' in plain:
        yield RoughBalance('reference speed', at.speed[side] * per,
                           {'speed': Term(plain['reference_velocity'], 1.0, SAME)}, one[:, :0],
                           loop=True)


def _drive(at: Signals, servo: Servo) -> Iterator[RoughBalance]:
    values, one = servo.values, np.ones((len(at), 1))
    side = motor_side(at, values['mechanism.ratio'])
    if servo.drive.name == 'pmsm_drive' and side is not None and 'voltage' in at.plain:
        yield RoughBalance('drive', side[1] * at.speed[side[0]], {'gain': Term(
            values['drive.speed_gain'] * at.plain['voltage'], 1.0, SAME)}, one)
    own = drive_equation(at, servo)
    if own is not None and servo.drive.name == 'voltage_drive':
        yield RoughBalance('drive', own.told, {
            'resistance': Term(own.current, own.ohms, GIVEN),
            'back EMF': Term(own.speed, own.per_speed, GIVEN)}, one, open=OPEN_WINDING)
    elif own is not None:
        yield RoughBalance('drive', own.current, {
            'gain': Term(_wanted(at.plain['voltage'], servo), 1.0, GIVEN)}, one)


def _torques(at: Signals, servo: Servo) -> Iterator[RoughBalance]:
    values, plain = servo.values, at.plain
    ratio = values['mechanism.ratio']
    side, told = motor_side(at, ratio), torque_of_drive(at, servo)
    viscous, level = friction_given(servo)
    pushed = plain.get('external_torque', np.zeros(len(at)))
    if side is not None and told is not None:
        angle, factor = side
        seen, damping = told
        terms = _resisting(at, angle, factor, inertia_of(servo), viscous / ratio**2 + damping,
                           level / ratio)
        own = RoughBalance('torque', seen - pushed / ratio, terms, *_place(
            factor * plain[angle] / ratio, servo))
        if not _evenly(at.speed[angle]):
            yield own
        if 'torque' in plain:
            motor = _resisting(at, angle, factor, rotor_of(servo), 0.0, 0.0)
            yield RoughBalance('sensor', plain['torque'] / ratio, {
                'torque': Term(seen, 1.0, GIVEN),
                **{name: Term(-term.column, term.centre, term.spread)
                   for name, term in motor.items()}}, np.ones((len(at), 1)))
    if 'torque' in plain and side is not None:
        angle = 'load_position' if 'load_position' in plain else 'motor_position'
        per = 1.0 if angle == 'load_position' else 1.0 / ratio
        terms = _resisting(at, angle, per, values['mechanism.load_inertia'], viscous, level)
        yield RoughBalance('load', plain['torque'] - pushed, terms,
                           *_place(per * plain[angle], servo))


def _evenly(speed: np.ndarray) -> bool:
    """
    Tell whether a loop holds a speed: then what accelerates the shaft is what the file lacks.

    So its inertia says nothing of a torque: cogging would have it in any unit.
    """
    return float(np.std(speed)) < EVENLY * abs(float(np.mean(speed)))


def _resisting(at: Signals, angle: str, factor: float, inertia: float, viscous: float,
               level: float) -> dict[str, Term]:
    """Return inertia and friction of a shaft on which the angle is ``factor`` times as large."""
    columns = {'viscous friction': (factor * at.speed[angle], viscous),
               'Coulomb friction': (at.sign[angle], level)}
    terms = {'inertia': Term(factor * at.acceleration[angle], inertia, ABOUT)} if inertia else {}
    for name, (column, given) in columns.items():
        terms[name] = Term(column, given, FRICTION_GIVEN if given else FREE)
    return terms


def _place(angle: np.ndarray, servo: Servo) -> tuple[np.ndarray, np.ndarray | None]:
    """
    Return what hangs on the place: offset and gravity, and the column of a spring.

    A spring that the servo file has is among the first.
    """
    columns = [np.ones_like(angle)]
    if not servo.linear:
        columns += [np.cos(angle), np.sin(angle)]
    spring = angle - np.mean(angle)
    if any(placed.effect in SPRINGS for placed in servo.effects):
        return np.stack([*columns, spring], 1), None
    return np.stack(columns, 1), spring


def friction_given(servo: Servo) -> tuple[float, float]:
    """Return slope and level of the friction of the servo file at the load."""
    found = {'slope': 0.0, 'level': 0.0}
    ratio = servo.values['mechanism.ratio']
    for placed in servo.effects:
        if placed.effect.port != 'friction':
            continue
        for name in found:
            value = servo.values.get(f'effects.{placed.name}.{name}', 0.0)
            if isinstance(value, float) and value > 0.0:
                power = {'slope': 2, 'level': 1}[name]
                found[name] += value * (ratio**power if placed.site == 'motor' else 1.0)
    return found['slope'], found['level']
