"""A machine as inertias, springs and dampers, where the laws of its effects are steepest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .drive_reach import largest_torsion, Reach
from .drives import winding
from .plain_laws import acts_at, values_of
from .servo import Placed, Servo
from .steepest_slopes import (
    by_current,
    of_error,
    of_friction,
    of_mesh,
    of_signal,
    of_torque,
)


@dataclass(frozen=True)
class Swinging:
    """
    A machine where its laws are steepest, the motor first.

    ``inertias`` (n,), ``springs`` and ``dampers`` (n, n), in SI units. ``winding`` is resistance,
    ohm, inductance, H, back-EMF, V s/rad, and torque constant, N m/A; None where a drive sets the
    current whatever the motor does.
    """

    inertias: np.ndarray
    springs: np.ndarray
    dampers: np.ndarray
    winding: tuple[float, float, float, float] | None
    rising: np.ndarray
    """Slopes of friction by the speed of its shaft, N m s/rad, (n,)."""


def swinging(servo: Servo, pushed: bool = True) -> Swinging | None:
    """
    Return a machine where its laws are steepest, or None if its mechanism does not say.

    Not ``pushed``: at rest and along its curves, as if nothing limited the drive.
    """
    values = {path.partition('.')[2]: value for path, value in servo.values.items()
              if path.startswith('mechanism.')}
    if servo.mechanism.springs(values, 0.0, 0.0) is None:
        return None
    reach, ratio = Reach(servo, pushed), servo.number('mechanism.ratio')
    most = reach.current if reach.limited else 0.0  # A
    parts = servo.mechanism.springs(values, *_of_mesh(servo, reach))
    assert parts is not None
    inertias, springs, dampers = (np.array(part, dtype=float) for part in parts)
    _waving(servo, reach, springs, dampers)
    last, rising = len(inertias) - 1, np.zeros(len(inertias))
    turns = 1.0 / ratio if last == 0 else 1.0  # one shaft for both
    for placed in servo.effects:
        for site, shaft, lever, gear in (('motor', 0, 1.0, 1.0), ('load', last, turns, ratio)):
            if acts_at(placed, 'torque', site):
                by_angle, by_speed = of_torque(servo, placed, most)
                springs[shaft, shaft] += max(0.0, by_angle) * lever**2
                dampers[shaft, shaft] += max(0.0, by_speed) * lever**2
            if acts_at(placed, 'friction', site):
                push = _at_shaft(reach, gear) if reach.limited else None
                rising[shaft] += max(0.0, of_friction(servo, placed, push)) * lever**2
        hanging = placed.effect.hangs(values_of(servo, placed))
        if hanging is not None:
            inertias, springs, dampers = _hung(inertias, springs, dampers, turns, *hanging)
            rising = np.append(rising, 0.0)
    coil = _coil(servo, dampers, most)
    return Swinging(inertias, springs, dampers, coil, rising)


def _at_shaft(reach: Reach, gear: float) -> Callable[[float], float]:
    """Return the most torque of the drive at a shaft by its speed, behind a gear."""
    return lambda speed: gear * reach.push(gear * speed)


def _meshes(servo: Servo, port: str) -> list[Placed]:
    return [placed for placed in servo.effects if acts_at(placed, port, 'mesh')]


def _of_mesh(servo: Servo, reach: Reach) -> tuple[float, float]:
    """Return what effects add at most to the stiffness and the damping of the mesh."""
    meshes = _meshes(servo, 'mesh')
    torsion = 0.0
    if meshes and reach.limited:
        torque = servo.number('mechanism.ratio') * reach.push(0.0)
        torsion = largest_torsion(servo, meshes, torque)
    both = [of_mesh(servo, placed, torsion) for placed in meshes]
    return sum(one for one, _ in both), sum(one for _, one in both)


def _waving(servo: Servo, reach: Reach, springs: np.ndarray, dampers: np.ndarray) -> None:
    """Put errors of the teeth into springs and dampers of two shafts: both see a wavy lever."""
    if len(springs) != 2:
        return
    ratio = servo.number('mechanism.ratio')
    for by_load, by_motor, bend in (of_error(servo, one) for one in _meshes(servo, 'mesh_error')):
        for part in (springs, dampers):
            part[0, :] *= 1.0 + by_motor * ratio
            part[:, 0] *= 1.0 + by_motor * ratio
        springs[:, 1] *= 1.0 + by_load
        springs[0, 0] += bend * ratio * (reach.push(0.0) if reach.limited else 0.0)


def _coil(servo: Servo, dampers: np.ndarray, most: float
          ) -> tuple[float, float, float, float] | None:
    """
    Return the winding of a drive; None where the drive sets the current.

    A limit of the command or the current that falls with the motor speed damps the motor, as a
    back EMF does: it is added to the back EMF, or to ``dampers``. ``most`` is the largest current.
    """
    values = {path: value for path, value in servo.values.items() if not isinstance(value, tuple)}
    gain, resistance = winding(values)
    constant = values.get('drive.torque_constant', 0.0)
    constant += max(0.0, sum(by_current(servo, placed, most) for placed in servo.effects
                             if acts_at(placed, 'torque', 'motor')))
    falls = {site: sum(of_signal(servo, placed) for placed in servo.effects
                       if acts_at(placed, 'drive', site)) for site in ('command', 'current')}
    dampers[0, 0] += constant * falls['current']
    by_command = max(0.0, gain) * falls['command']
    own = [values.get(f'drive.{name}') for name in ('resistance', 'inductance', 'back_emf')]
    if None in own:
        dampers[0, 0] += constant * by_command
        return None
    alone, inductance, back_emf = (float(one) for one in own if one is not None)
    return resistance if by_command else alone, inductance, back_emf + by_command, constant


def _hung(inertias: np.ndarray, springs: np.ndarray, dampers: np.ndarray, turns: float,
          inertia: float, spring: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a machine with one more inertia (kg m2) that hangs on its load by a spring."""
    size = len(inertias)
    wider = np.zeros((2, size + 1, size + 1))
    wider[:, :size, :size] = springs, dampers
    hold = np.zeros(size + 1)
    hold[size - 1], hold[size] = turns, -1.0
    return np.append(inertias, inertia), wider[0] + spring * np.outer(hold, hold), wider[1]
