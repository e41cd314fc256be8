"""
Passes over the turn: the angle lost between the shafts, at equal angles of the load.

A pass is one stretch in one direction at a steady speed. What is lost between the shafts,

.. math:: e(\\theta_l) = \\theta_m / N - \\theta_l - T / K_{eq}

with the torsion that the torque explains taken off, is averaged in equal cells of the load's turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ...fit.segments import smoothed

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Pass:
    """
    One direction over the turn.

    ``lost`` rad at the load in each of the cells of the turn, NaN where it did not go; ``speed``
    rad/s at the load (positive) and ``load`` the mean transmitted torque, N m, signed.
    """

    recording: str
    forward: bool
    speed: float
    load: float
    external: float
    lost: np.ndarray

    @property
    def covered(self) -> float:
        """Share of the turn that was passed."""
        return float(np.isfinite(self.lost).mean())


def passes_of(servo: Servo, recordings: list[Recording], cells: int = 720,
              wind_up: bool = True) -> list[Pass]:
    """
    Return the passes in recordings, those that cover a tenth of a turn or more.

    ``wind_up`` takes off what the stiffness of the servo file explains of the measured torque.
    Raises ValueError where a recording lacks one of the encoders.
    """
    found = []
    for recording in recordings:
        for column in ('motor_position', 'load_position'):
            if not recording.has(column):
                raise ValueError(f'{recording.name}: the angle lost between the shafts needs both '
                                 f'encoders, and {column} is missing')
        found += _passes(servo, recording, cells, wind_up)
    return found


def _passes(servo: Servo, recording: Recording, cells: int, wind_up: bool) -> list[Pass]:
    period, value = recording.period, servo.values
    motor, load = recording['motor_position'], recording['load_position']
    torque = recording['torque'] if recording.has('torque') else np.zeros(len(load))
    lost = motor / value['mechanism.ratio'] - load
    if wind_up and servo.mechanism.compliant:
        lost = lost - torque / value['mechanism.stiffness']
    speed = np.gradient(smoothed(load, period, 10.0), period)
    found = []
    for forward in (True, False):
        way = 1.0 if forward else -1.0
        going = np.nan_to_num(way * speed) > 1e-3
        if going.sum() * period < 0.2:
            continue
        usual = np.median(way * speed[going])
        steady = going & (np.abs(way * speed - usual) < 0.1 * usual)
        margin = 2 * round(0.15 / period) + 1
        steady = np.convolve(~steady, np.ones(margin), 'same') < 0.5
        if not steady.any():
            continue
        cell = np.minimum((np.mod(load[steady], TURN) / TURN * cells).astype(int), cells - 1)
        count = np.bincount(cell, minlength=cells)
        with np.errstate(invalid='ignore', divide='ignore'):
            mean = np.bincount(cell, lost[steady], cells) / count
        item = Pass(recording.name, forward, float(usual), float(np.mean(torque[steady])),
                    float(np.nanmean(np.nan_to_num(recording['external_torque'][steady]))), mean)
        if item.covered > 0.1:
            found.append(item)
    return found


def angles(cells: int) -> np.ndarray:
    """Return the middle of each cell, rad."""
    return (np.arange(cells) + 0.5) * TURN / cells
