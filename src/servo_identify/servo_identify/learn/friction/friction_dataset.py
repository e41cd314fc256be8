"""Friction as features and target, split by time (paper 003 sections 3.2 to 3.4)."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from .friction_features import FEATURES
from .friction_samples import FrictionSamples

SEQUENCE = 20  # samples a window, paper 003 table 1
FEW = 3  # reversals of a run up to which each direction is split by itself
FAST = 0.8  # samples above this share of the top speed are kept to test extrapolation


@dataclass(frozen=True)
class Dataset:
    """
    The same rows for every learner.

    ``features`` (samples, 3): speed rad/s, acceleration rad/s2, current A; ``target`` (samples,)
    friction, N m, with the sign of the motion it resists; ``run`` (samples,); ``period`` s.
    ``train``, ``validation``, ``test`` and ``beyond`` are the numbers of samples whose window of
    :data:`SEQUENCE` samples ends there and lies within one run; ``beyond`` is faster than any of
    the others. ``unseen`` are those of runs of which nothing else was taken.
    """

    features: np.ndarray
    target: np.ndarray
    angle: np.ndarray
    run: np.ndarray
    period: float
    train: np.ndarray
    validation: np.ndarray
    test: np.ndarray
    beyond: np.ndarray
    unseen: np.ndarray = field(default_factory=lambda: np.array([], dtype=int))

    def windows(self, rows: np.ndarray) -> np.ndarray:
        """Return (rows, SEQUENCE, 3), the sample itself last."""
        return self.features[rows[:, None] + np.arange(1 - SEQUENCE, 1)]


def dataset_of(samples: FrictionSamples, period: float = 0.01, most: int = 30_000,
               unseen: Collection[int] = (), without: Collection[str] = ()) -> Dataset:
    """
    Thin samples to ``period`` s and split each run: 60 % train, 20 % validation, 20 % test.

    Chronological, so that no window of one part holds a sample of another's target. A run of few
    reversals, such as a turn there and back, is split in each direction by itself, or the test
    would see one direction only and the training hardly that one. ``most`` limits the number of
    training windows. ``unseen`` are numbers of runs (as in ``samples.run``) that are kept back
    whole; ``beyond`` is then what is faster there than anything in the other runs, else what is
    faster than :data:`FAST` of the top speed, which nothing is trained on. ``without`` names
    features that are zero everywhere, so that they tell nothing: where there is no torque sensor,
    friction *is* a sum of current and acceleration (paper 003 eq. 4), and whoever is given both
    needs to know nothing of friction.
    Raises ValueError for an unknown feature, and when too little is left.
    """
    unknown = sorted(set(without) - set(FEATURES))
    if unknown:
        raise ValueError(f'there is no feature {unknown[0]!r}; there are {list(FEATURES)}')
    every = max(1, round(period / samples.period))
    thin = samples[::every]
    features = np.column_stack([thin.speed, thin.acceleration, thin.current])
    features[:, [FEATURES.index(name) for name in without]] = 0.0
    speed, new = np.abs(thin.speed), np.isin(thin.run, list(unseen))
    if new.all():
        raise ValueError('every recording is to be kept back; there is none to train on')
    fast = speed > (speed[~new].max() if new.any() else FAST * speed.max())
    parts: list[list[np.ndarray]] = [[], [], [], [], []]
    for run in np.unique(thin.run[new]):
        rows = np.flatnonzero(thin.run == run)[SEQUENCE - 1:]
        parts[3].append(rows[fast[rows]])
        parts[4].append(rows[~fast[rows]])
    for run in np.unique(thin.run[~new]):
        everything = np.flatnonzero(thin.run == run)
        stretches = [s[SEQUENCE - 1:] for s in _by_direction(everything, thin.speed[everything])]
        for rows in filter(len, stretches):
            _split(rows, fast, parts)
    train, validation, test, beyond, kept_back = (
        np.concatenate(p) if p else np.array([], dtype=int) for p in parts)
    if min(len(train), len(validation), len(test)) < 50:
        raise ValueError(f'{len(train)} windows to train, {len(validation)} to validate and '
                         f'{len(test)} to test are too few (50 each); give longer recordings')
    train = train[::max(1, len(train) // most)]
    return Dataset(features, thin.torque, thin.angle, thin.run, every * samples.period, train,
                   validation, test, beyond, kept_back)


def _split(rows: np.ndarray, fast: np.ndarray, parts: list[list[np.ndarray]]) -> None:
    """Add the samples of one stretch to train, validation, test and beyond."""
    if fast[rows].mean() > 0.3:
        parts[3].append(rows[fast[rows]])
        return
    cuts = np.split(rows, [int(0.6 * len(rows)), int(0.8 * len(rows))])
    for i, cut in enumerate(cuts):
        ready = cut if i == 0 else cut[SEQUENCE - 1:]
        parts[3].append(ready[fast[ready]])
        parts[i].append(ready[~fast[ready]])


def _by_direction(rows: np.ndarray, speed: np.ndarray) -> list[np.ndarray]:
    """Cut a run where it turns round, if it does so up to FEW times; else leave it whole."""
    going = np.flatnonzero(np.abs(speed) > 0.1 * np.abs(speed).max())
    turns = going[1:][np.diff(np.sign(speed[going])) != 0.0]
    return np.split(rows, turns) if len(turns) <= FEW else [rows]
