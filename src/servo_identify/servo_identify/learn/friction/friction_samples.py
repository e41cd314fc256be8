"""
Friction of each sample, from the torque balance of its shaft.

All channels pass one zero-phase low pass (Butterworth of second order, run forwards and
backwards), so that none is late against another; speed and acceleration are central differences of
the filtered position,

.. math:: \\dot\\theta_k = \\frac{\\theta_{k+1} - \\theta_{k-1}}{2T}, \\quad
          \\ddot\\theta_k = \\frac{\\theta_{k+1} - 2\\theta_k + \\theta_{k-1}}{T^2}

(paper 003 eq. 2), whose error is below 1 % up to a thirteenth of the sampling rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from servo_twin.physics.catalogue import find
from servo_twin.physics.ports import Shaft
from servo_twin.physics.servo import Placed, Servo
from servo_twin.recording.recording import Recording

from ...fit.segments import smoothed

BRISTLES = ('presliding_friction', 'dahl_friction')
"""Effects that are friction although they act as torques: they hold memory of the motion."""


@dataclass(frozen=True)
class FrictionSamples:
    """
    What friction did, sample by sample.

    ``angle`` rad, ``speed`` rad/s, ``acceleration`` rad/s2 of the shaft at ``site``; ``torque``
    the friction against the motion, N m, positive where it resists positive motion; ``current`` A;
    ``load`` the transmitted torque as the shaft feels it, N m (NaN where not known); ``run`` the
    number of the recording each sample is of. All of shape (samples,). ``period`` s.
    """

    site: str
    period: float
    angle: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray
    current: np.ndarray
    load: np.ndarray
    run: np.ndarray

    def __len__(self) -> int:
        return len(self.torque)

    def __getitem__(self, rows) -> FrictionSamples:
        names = ('angle', 'speed', 'acceleration', 'torque', 'current', 'load', 'run')
        return FrictionSamples(self.site, self.period, *(getattr(self, n)[rows] for n in names))


def friction_of(servo: Servo, recordings: list[Recording], site: str | None = None,
                cutoff: float = 20.0) -> FrictionSamples:
    """
    Return the friction at a shaft.

    With a torque sensor the load side is ``T - J_l a_l - T_ext`` and the motor side
    ``K_m i - J_m a_m - T/N``; without one both are counted at the load,
    ``N K_m i - (N^2 J_m + J_l) a_l - T_ext`` (paper 003 eq. 3 and 4). Torques of the servo's other
    effects at that shaft (gravity, springs) are taken off. ``site`` None: the load. ``cutoff`` Hz.
    Raises ValueError where a recording lacks current (or a command to make it of) or position.
    """
    parts = [_one(servo, r, site or 'load', cutoff, i) for i, r in enumerate(recordings)]
    if not parts:
        raise ValueError('there is no recording to learn friction from')
    periods = {part.period for part in parts}
    if len(periods) > 1:
        raise ValueError(f'recordings have different periods {sorted(periods)} s; '
                         'friction is learned from recordings of one period')
    columns = ('angle', 'speed', 'acceleration', 'torque', 'current', 'load', 'run')
    return FrictionSamples(parts[0].site, parts[0].period, *(
        np.concatenate([getattr(p, c) for p in parts]) for c in columns))


def _one(servo: Servo, recording: Recording, site: str, cutoff: float,
         run: int) -> FrictionSamples:
    if site not in ('motor', 'load'):
        raise ValueError(f"site = {site!r}; friction is at one of ['motor', 'load']")
    value, period = servo.values, recording.period
    ratio = value['mechanism.ratio']

    def calm(signal: np.ndarray) -> np.ndarray:
        return smoothed(signal, period, cutoff)

    motor, load = calm(recording['motor_position']), calm(recording['load_position'])
    if not recording.has('motor_position'):
        motor = load * ratio
    if not recording.has('load_position'):
        load = motor / ratio
    if not np.isfinite(load).any():
        raise ValueError(f'{recording.name}: neither motor_position nor load_position is in it')
    current = calm(_current(servo, recording, motor, calm(recording['voltage'])))
    transmitted = calm(recording['torque'])
    external = calm(np.nan_to_num(recording['external_torque']))
    motor_push = value['drive.torque_constant'] * current
    angle = motor if site == 'motor' else load
    speed, acceleration = differences(angle, period)
    if site == 'motor':
        if not recording.has('torque'):
            raise ValueError(f'{recording.name}: without the column torque the friction of the '
                             'motor side cannot be told from that of the load side')
        felt = transmitted / ratio
        push = motor_push - felt - value['mechanism.rotor_inertia'] * acceleration
    elif recording.has('torque'):
        felt = transmitted
        push = transmitted - value['mechanism.load_inertia'] * acceleration - external
    else:
        felt = motor_push * ratio
        inertia = value['mechanism.rotor_inertia'] * ratio**2 + value['mechanism.load_inertia']
        push = felt - inertia * acceleration - external
    push = push + _other_torques(servo, site, angle, speed, felt, current, recording)
    rows = slice(2, -2)
    whole = FrictionSamples(site, period, angle, speed, acceleration, push, current, felt,
                            np.full(len(recording), run))[rows]
    return whole[np.isfinite(whole.torque) & np.isfinite(whole.speed)]


def differences(angle: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Return central first and second differences, rad/s and rad/s2; NaN at both ends."""
    speed, acceleration = np.full((2, len(angle)), np.nan)
    speed[1:-1] = (angle[2:] - angle[:-2]) / (2.0 * period)
    acceleration[1:-1] = (angle[2:] - 2.0 * angle[1:-1] + angle[:-2]) / period**2
    return speed, acceleration


def _current(servo: Servo, recording: Recording, motor: np.ndarray,
             voltage: np.ndarray) -> np.ndarray:
    if recording.has('current'):
        return recording['current']
    if not recording.has('voltage'):
        raise ValueError(f'{recording.name}: neither current nor voltage is in it')
    value = servo.values
    if servo.drive.name == 'voltage_drive':
        speed = np.nan_to_num(differences(motor, recording.period)[0])
        return (value['drive.gain'] * voltage - value['drive.back_emf'] * speed) / value[
            'drive.resistance']
    return value['drive.gain'] * voltage


def conservative(servo: Servo, site: str) -> list[Placed]:
    """Return the servo's torque effects at a shaft that are not friction."""
    return [p for p in servo.effects if p.effect.port == 'torque' and p.site == site
            and p.effect.name not in BRISTLES]


def _other_torques(servo: Servo, site: str, angle: np.ndarray, speed: np.ndarray,
                   felt: np.ndarray, current: np.ndarray, recording: Recording) -> np.ndarray:
    total = np.zeros(len(angle))
    for placed in conservative(servo, site):
        law = find(placed.effect.name).law
        names = placed.effect.parameters
        p = _Values({n: servo.values[f'effects.{placed.name}.{n}'] for n in names})
        memory = np.zeros(placed.effect.memory)
        for k in range(len(angle)):
            if np.isfinite(speed[k]):
                way = 1.0 if speed[k] >= 0.0 else -1.0
                total[k] += law(p, memory, Shaft(angle[k], speed[k], way, felt[k], 0.0, current[k],
                                                 20.0, k * recording.period), recording.period)
    return total


class _Values:
    """Parameters by attribute, as a law wants them."""

    def __init__(self, values: dict) -> None:
        self.__dict__.update(values)
