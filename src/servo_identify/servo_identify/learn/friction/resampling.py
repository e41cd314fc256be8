"""Steady stretches of a recording, resampled at equal angles (paper 000 section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .friction_samples import FrictionSamples

CALM = 0.15  # s


@dataclass(frozen=True)
class AngleTable:
    """
    Friction over angle and speed, in columns of equal angles.

    ``angle`` rad within ``turn``, ``speed`` rad/s (never negative), ``torque`` N m as it resists
    (positive), ``load`` the transmitted torque, N m, positive where it is along the motion (NaN
    where not known), ``forward`` bool. All of shape (rows,).
    """

    turn: float
    angle: np.ndarray
    speed: np.ndarray
    torque: np.ndarray
    load: np.ndarray
    forward: np.ndarray

    def __len__(self) -> int:
        return len(self.angle)

    def __getitem__(self, rows) -> AngleTable:
        return AngleTable(self.turn, self.angle[rows], self.speed[rows], self.torque[rows],
                          self.load[rows], self.forward[rows])


def equal_angles(samples: FrictionSamples, cells: int = 360, turn: float = 2.0 * np.pi,
                 steady: float = 0.1, slowest: float = 1e-3) -> AngleTable:
    """
    Average the steady samples of each run and direction over ``cells`` equal parts of the turn.

    Steady is a sample whose speed has, for :data:`CALM` seconds before and after it, been within
    ``steady`` of the median of its run and direction and above ``slowest`` rad/s. Raises
    ValueError when nothing is steady.
    """
    rows, width = [], 2 * round(CALM / samples.period) + 1
    for run in np.unique(samples.run):
        for forward in (True, False):
            way = 1.0 if forward else -1.0
            mine = (samples.run == run) & (way * samples.speed > slowest)
            if mine.sum() < 10:
                continue
            speed = way * samples.speed[mine]
            usual = np.median(speed)
            wild = np.abs(speed - usual) >= steady * usual
            wild[1:] |= np.diff(np.flatnonzero(mine)) > 1
            wild[[0, -1]] = True
            calm = np.convolve(wild, np.ones(width), 'same') < 0.5
            angle = np.mod(samples.angle[mine][calm], turn)
            if not len(angle):
                continue
            cell = np.minimum((angle / turn * cells).astype(int), cells - 1)
            count = np.bincount(cell, minlength=cells)
            there = count > 0
            means = [np.bincount(cell, values, cells)[there] / count[there]
                     for values in (speed[calm], way * samples.torque[mine][calm],
                                    way * samples.load[mine][calm])]
            rows.append(np.column_stack([(np.flatnonzero(there) + 0.5) * turn / cells, *means,
                                         np.full(there.sum(), forward)]))
    if not rows:
        raise ValueError('no recording has a steady stretch: friction over angle and speed needs '
                         'turns at constant speed, in both directions')
    table = np.concatenate(rows)
    return AngleTable(turn, *table[:, :4].T, table[:, 4] > 0.5)
