"""
How the current follows its command, from command, motor speed and measured current alone.

A current loop is not fast against everything: the back EMF of a motor that accelerates pulls the
current away from its reference. That is fitted along the measured motion, so that nothing of the
mechanics can bias it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from servo_twin.physics.catalogue import find
from servo_twin.physics.driven_current import driven_current
from servo_twin.physics.servo import Placed, Provenance, Servo
from servo_twin.recording.recording import Recording

from ..fit.estimate import bag_name
from ..fit.segments import smoothed

DROOP = 'back_emf_droop'
FREE = ('drive.gain', f'effects.{DROOP}.droop', f'effects.{DROOP}.electrical',
        f'effects.{DROOP}.closed')
STARTS = ((1e-5, 3e-3, 3e-4), (1e-4, 3e-3, 1e-3), (1e-4, 1e-2, 1e-3))
CUTOFF = 200.0  # Hz, of the motor speed
BLOCK = 1.0  # s over which residuals may be correlated


@dataclass(frozen=True)
class CurrentLoop:
    """
    What was fitted.

    ``values`` and ``std`` by path (:data:`FREE`); ``rms`` of the current that is left, A, with the
    loop and, ``rms_without``, with nothing but the gain of the servo file.
    """

    values: dict[str, float]
    std: dict[str, float]
    rms: float
    rms_without: float
    bags: tuple[str, ...]


def learned_current_loop(servo: Servo, recordings: Sequence[Recording]) -> CurrentLoop:
    """
    Fit gain and droop to the measured current.

    Raises ValueError for a servo without a current drive, and for recordings without voltage,
    current and motor position.
    """
    if servo.drive.name != 'current_drive':
        raise ValueError(f'{servo.name}: the drive is a {servo.drive.name}; a current loop is '
                         'learned for a current_drive')
    tracks = [_Track.of(servo, recording) for recording in recordings]
    if not tracks:
        raise ValueError('there is no recording to learn the current loop from')
    looped = with_current_loop(servo, None)
    slots = np.array([looped.slots()[path].start for path in FREE])
    base = looped.theta

    def theta(x: np.ndarray) -> np.ndarray:
        changed = base.copy()
        changed[slots] = np.exp(x) * base[slots[0]] ** (np.arange(len(x)) == 0)
        return changed

    def residual(x: np.ndarray) -> np.ndarray:
        return np.concatenate([track.residual(looped, theta(x)) for track in tracks])

    tried = [least_squares(residual, np.log([1.0, *start]), x_scale=0.3, max_nfev=60,
                           diff_step=1e-4) for start in STARTS]
    best = min(tried, key=lambda found: found.cost)
    values = theta(best.x)[slots]
    std = values * np.sqrt(np.diag(_spread(best.jac, best.fun, tracks)))
    still = np.concatenate([track.residual(servo, servo.theta) for track in tracks])
    return CurrentLoop(dict(zip(FREE, values.tolist(), strict=True)),
                       dict(zip(FREE, std.tolist(), strict=True)),
                       float(np.sqrt(np.mean(best.fun**2))), float(np.sqrt(np.mean(still**2))),
                       tuple(bag_name(r) for r in recordings))


def with_current_loop(servo: Servo, found: CurrentLoop | None) -> Servo:
    """Return the servo with the droop of a current loop; None: at its defaults."""
    bare = servo.without_effects(lambda placed: placed.effect.name == DROOP)
    values, said = {}, {}
    if found is not None:
        values = found.values
        said = {path: Provenance('current along the measured motion', found.std[path], found.bags)
                for path in FREE}
    tolerance = {path: edges for path, edges in bare.tolerance.items()
                 if path not in values or edges[0] <= values[path] <= edges[1]}
    return replace(bare, tolerance=tolerance).with_effects(
        Placed(DROOP, find(DROOP), 'current'), values=values, provenance=said)


@dataclass(frozen=True)
class _Track:
    """One recording: command, V, motor speed, rad/s, and measured current, A."""

    voltage: np.ndarray
    speed: np.ndarray
    current: np.ndarray
    period: float

    @classmethod
    def of(cls, servo: Servo, recording: Recording) -> _Track:
        for column in ('voltage', 'current', 'motor_position'):
            if not recording.has(column):
                raise ValueError(f'{recording.name}: {column} is missing, which the current loop '
                                 'is learned from')
        motor = smoothed(recording['motor_position'], recording.period, CUTOFF)
        grid = np.arange(len(motor))
        known = np.isfinite(motor)
        speed = np.gradient(np.interp(grid, grid[known], motor[known]), recording.period)
        return cls(np.nan_to_num(recording['voltage']), speed, recording['current'],
                   recording.period)

    def residual(self, servo: Servo, theta: np.ndarray) -> np.ndarray:
        """Twin minus rig, A, zero where no current was measured."""
        made = driven_current(servo, theta, self.voltage, self.speed, self.period,
                              float(np.nan_to_num(self.current[0])))[:, 0]
        left = np.nan_to_num(made - self.current)
        left[:50] = 0.0  # memories that begin at rest
        return left


def _spread(jacobian: np.ndarray, residual: np.ndarray, tracks: Sequence[_Track]) -> np.ndarray:
    """Covariance by blocks: nothing is assumed of residuals within one."""
    edges, at = [], 0
    for track in tracks:
        edges += range(at, at + len(track.current), max(1, round(BLOCK / track.period)))
        at += len(track.current)
    scores = np.add.reduceat(jacobian * residual[:, None], edges)
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    return inverse @ (scores.T @ scores) @ inverse
