"""
Angles of a recording held against each other, to find columns in another unit or on another shaft.

Over a motion that is more than play and noise, motor_position / ratio, load_position and
reference_position move together. A constant factor between them that is 180/pi or the ratio, or a
negative one, is a mistake in the table and not the machine. So is any factor between the two
encoders that no transmission makes: backlash and slip lose motion and then do not move together,
and a spring adds motion only near its resonance.
"""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.step_limit import doubt_of_ratio

_TOGETHER = 0.99
"""Correlation from which on two angles count as the same motion."""

_NEAR = 0.1
"""Relative distance within which a factor is taken for a known one."""

FURTHEST = 3.0
"""Factor between the angles of both shafts, each brought to the load, that no machine reaches."""

_SLOW = 0.5
"""Share of the resonance of the load on its spring below which it follows within a third."""


def check_angles(path: Path, columns: dict[str, np.ndarray], servo: Servo) -> None:
    """
    Raise ValueError when two angles differ by a factor that is a mistake, or in direction.

    ``columns`` in rad, each on its own shaft, and ``t`` in s.
    """
    ratio = servo.values['mechanism.ratio']
    at_load = {}
    if _moves(columns.get('load_position')):
        at_load['load_position'] = columns['load_position']
    if _moves(columns.get('motor_position')):
        at_load['motor_position'] = columns['motor_position'] / ratio
    reference = columns.get('reference_position')
    names = list(at_load)
    if len(names) == 2:
        _compare(path, 'motor_position / ratio', at_load['motor_position'], 'load_position',
                 at_load['load_position'], ratio)
        apart = factor_apart(columns, servo)
        if apart != 1.0:
            raise ValueError(f'{path}: {contradiction(apart, servo)}')
    if names and _moves(reference):
        told = 'motor_position / ratio' if names[0] == 'motor_position' else names[0]
        _compare(path, 'reference_position', reference, told, at_load[names[0]], ratio)


def factor_apart(columns: dict[str, np.ndarray], servo: Servo) -> float:
    """
    Return how many times as far as the load the motor / ratio moves; 1 where that can be.

    ``columns`` in rad, and ``t`` in s. A factor of :data:`FURTHEST` is left to noise, to soft
    transmissions and to servo files of another gear. Motion near the resonance of the load on
    the spring of the servo file, where the load may move further, is not judged.
    """
    ratio = servo.values['mechanism.ratio']
    both = [columns[name] for name in ('motor_position', 'load_position')]
    known = np.isfinite(both[0]) & np.isfinite(both[1])
    motor, load, time = both[0][known] / ratio, both[1][known], columns['t'][known]
    if known.sum() < 3 or not (_moves(motor) and _moves(load)):
        return 1.0
    factor = float(np.std(motor) / np.std(load))
    if 1.0 / FURTHEST < factor < FURTHEST or np.corrcoef(motor, load)[0, 1] < _TOGETHER:
        return 1.0
    stiffness, inertia = (servo.values.get(f'mechanism.{name}', 0.0)
                          for name in ('stiffness', 'load_inertia'))
    if stiffness > 0.0 and inertia > 0.0 and (
            _frequency(time, load) > _SLOW * sqrt(stiffness / inertia)):
        return 1.0
    return factor


def contradiction(factor: float, servo: Servo) -> str:
    """Say that the motor moves so many times as far as the load follows, and what to do."""
    ratio = servo.values['mechanism.ratio']
    return (f'motor_position / ratio moves {factor:.4g} times as far as load_position (ratio '
            f'{ratio:g}), and a transmission leaves a factor of {FURTHEST:g} at most. Give the '
            "units of both, as in 'load_position [deg]' or 'motor_position [1/4096 rev]', or the "
            'ratio of the gear that was recorded' + doubt_of_ratio(servo))


def _frequency(time: np.ndarray, angle: np.ndarray) -> float:
    """Return the frequency, rad/s, of most of a motion beside its drift."""
    rows = np.arange(len(angle))
    swing = angle - np.polyval(np.polyfit(rows, angle, 1), rows)
    most = int(np.argmax(np.abs(np.fft.rfft(swing))))
    return float(2.0 * pi * most / max(time[-1] - time[0], 1e-9))


def _moves(column: np.ndarray | None) -> bool:
    if column is None or np.isfinite(column).sum() <= 2:
        return False
    return bool(np.nanstd(column) > 0.0)


def _compare(path: Path, name: str, value: np.ndarray, other: str, base: np.ndarray,
             ratio: float) -> None:
    known = np.isfinite(value) & np.isfinite(base)
    if known.sum() < 3 or not (_moves(value[known]) and _moves(base[known])):
        return
    together = float(np.corrcoef(value[known], base[known])[0, 1])
    if abs(together) < _TOGETHER:
        return
    factor = float(np.std(value[known]) / np.std(base[known]))
    if together < 0.0:
        raise ValueError(f'{path}: {name} runs against {other}; positive must be the same way on '
                         'both shafts. Turn the sign of one: negate: true in a mapping file, '
                         "which --column 'motor_position=-SOURCE' of init writes")
    meanings = {180.0 / pi: f'{name} looks like degrees',
                pi / 180.0: f'{other} looks like degrees'}
    if ratio > 1.0 + 2.0 * _NEAR:
        meanings |= {ratio: f'{name} and {other} look as if one were on the other shaft',
                     1.0 / ratio: f'{name} and {other} look as if one were on the other shaft'}
    for known_factor, meaning in meanings.items():
        if abs(factor / known_factor - 1.0) < _NEAR:
            raise ValueError(
                f'{path}: {name} moves {factor:.4g} times as far as {other} (ratio {ratio:g}): '
                f'{meaning}. Angles are in rad, each on its own shaft; a header may give the '
                "unit, as in 'load_position [deg]'" + _of_motor(name, factor, ratio))


def _of_motor(name: str, factor: float, ratio: float) -> str:
    """Say how a reference of the motor becomes that of the load, '' where it is none."""
    if name != 'reference_position' or abs(factor / ratio - 1.0) > _NEAR:
        return ''
    return ('. A drive has the reference of its motor; divide that by the ratio: '
            f'1/4096 rev becomes 1/{4096 * ratio:.9g} rev')
