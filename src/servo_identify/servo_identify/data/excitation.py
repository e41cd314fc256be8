"""How much of a recording's torque each plain term explains: what it excites."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .rough_balances import inertia_of, torque_of_drive
from .signals import motor_side, Signals, signals

WIDTHS = (3.0, 8.0, 20.0, 50.0)
"""Standard deviations of the Gaussian that are tried, samples."""


@dataclass(frozen=True)
class Excitation:
    """
    The torque balance by plain least squares, under the Gaussian that shows the inertia best.

    ``inertia`` is the found one over that of the servo file (NaN where the file has none),
    ``share`` what of the torque left without a term that term explains.
    """

    signals: Signals
    inertia: float
    share: dict[str, float]


def excitation(one: Recording, servo: Servo) -> Excitation | None:
    """Return what a recording excites; None without an angle or a torque."""
    best = None
    for width in WIDTHS:
        at = signals(one, width)
        found = _by_least_squares(at, servo) if at is not None else None
        if found and (best is None or found.share.get('inertia', 0.0)
                      > best.share.get('inertia', 0.0)):
            best = found
    return best


def plain_terms(at: Signals, servo: Servo) -> tuple[np.ndarray, dict[str, np.ndarray]] | None:
    """Return the torque at the motor's shaft and the columns of its plain terms, (samples,)."""
    ratio = servo.values['mechanism.ratio']
    side, told = motor_side(at, ratio), torque_of_drive(at, servo)
    if side is None or told is None or not np.ptp(at.speed[side[0]]) > 0.0:
        return None
    angle, factor = side
    torque = told[0] - at.plain.get('external_torque', np.zeros(len(at))) / ratio
    speed = factor * at.speed[angle]
    terms = {'inertia': factor * at.acceleration[angle], 'viscous friction': speed,
             'Coulomb friction': at.sign[angle], 'offset': np.ones_like(speed)}
    if not servo.linear:
        place = factor * at.plain[angle] / ratio
        terms |= {'cosine': np.cos(place), 'sine': np.sin(place)}
    return torque, {name: column for name, column in terms.items() if np.any(column)}


def _by_least_squares(at: Signals, servo: Servo) -> Excitation | None:
    told = plain_terms(at, servo)
    if told is None:
        return None
    torque, terms = told
    names = list(terms)
    matrix = np.stack([terms[name] for name in names], 1)
    size = np.linalg.norm(matrix, axis=0)
    matrix = matrix / size

    def left(columns: np.ndarray) -> float:
        fit = np.linalg.lstsq(columns, torque, rcond=1e-9)[0]
        return float(np.sum((torque - columns @ fit)**2))

    whole = left(matrix)
    share = {}
    for k, name in enumerate(names[:3]):
        without = left(np.delete(matrix, k, 1))
        share[name] = 1.0 - whole / without if without > 0.0 else 0.0
    found = float(np.linalg.lstsq(matrix, torque, rcond=1e-9)[0][0] / size[0])
    own = inertia_of(servo)
    return Excitation(at, found / own if own > 0.0 else float('nan'), share)
