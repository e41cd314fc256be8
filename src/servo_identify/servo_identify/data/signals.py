"""Smoothed channels of a recording and their derivatives, in the units of a possible mistake."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from servo_twin.recording.recording import Recording

from .white_noise import FOURTH, QUARTILE

NOISES = 2.0  # times the noise that is left of a channel, up to which it may be nothing else
TURN = 2.0 * np.pi  # rad
APART = 0.25  # of the width, between samples: a Gaussian passes nothing finer
MOST = 20_000  # samples that are looked at: the first ones
ANGLES = ('motor_position', 'load_position')
OTHERS = ('voltage', 'current', 'current_reference', 'torque', 'external_torque',
          'reference_position', 'reference_velocity')


@dataclass(frozen=True)
class Signals:
    """
    Channels under one Gaussian of ``width`` samples; arrays of shape (samples,).

    As many samples are left as tell what passes the Gaussian.
    ``plain`` holds each measured channel in its own unit. ``speed``, ``acceleration`` and ``sign``
    (of the speed, smoothed) are those of each measured angle, on its own shaft. ``silent`` are
    channels that hold no more than the noise of a sensor.
    """

    width: float
    plain: Mapping[str, np.ndarray]
    speed: Mapping[str, np.ndarray]
    acceleration: Mapping[str, np.ndarray]
    sign: Mapping[str, np.ndarray]
    silent: frozenset[str] = frozenset()

    def __len__(self) -> int:
        return len(next(iter(self.plain.values()))) if self.plain else 0

    def scaled(self, factors: Mapping[str, float], time: float = 1.0,
               renamed: Mapping[str, str] | None = None) -> Signals:
        """Return the channels times ``factors``, under new names, with another unit of time."""
        names = renamed or {}

        def of(columns: Mapping[str, np.ndarray], order: int) -> dict[str, np.ndarray]:
            return {names.get(name, name): factors.get(name, 1.0) / time**order * column
                    for name, column in columns.items()}

        signs = {names.get(name, name): np.sign(factors.get(name, 1.0)) * column
                 for name, column in self.sign.items()}
        return Signals(self.width, of(self.plain, 0), of(self.speed, 1),
                       of(self.acceleration, 2), signs,
                       frozenset(names.get(name, name) for name in self.silent))


def signals(one: Recording, width: float) -> Signals | None:
    """Return the channels under a Gaussian; None where too few samples are left."""
    has = [name for name in (*ANGLES, *OTHERS) if one.has(name)]
    driven = [name for name in ('current', 'voltage') if name in has][:1]  # NaN: the drive is off
    needed = [*(name for name in ANGLES if name in has), *driven]
    known = np.all([np.isfinite(one[name][:MOST]) for name in needed], axis=0) if needed else None
    edge = int(4 * width)
    if known is None or len(known) < 2 * edge + 20 * width:
        return None
    kept = slice(edge, len(known) - edge)
    whole = gaussian_filter1d(known.astype(float), width)[kept] > 0.99
    if whole.sum() < 20 * width:
        return None

    apart = max(1, int(APART * width))

    def through(values: np.ndarray, order: int = 0) -> np.ndarray:
        return derived(values, width, order)[kept][whole][::apart] / one.period**order

    filled = {name: bridged(one[name][:MOST]) for name in has}
    angles = [name for name in ANGLES if name in has]
    speeds = {name: derived(filled[name], width, 1) for name in angles}
    plain = {name: through(column) for name, column in filled.items()}
    return Signals(width, plain,
                   {name: through(filled[name], 1) for name in angles},
                   {name: through(filled[name], 2) for name in angles},
                   {name: through(np.sign(speeds[name])) for name in angles},
                   frozenset(name for name in OTHERS if name in plain and _is_noise(
                       plain[name], filled[name], width)))


def derived(values: np.ndarray, width: float, order: int) -> np.ndarray:
    """
    Return a derivative of a channel, per sample, under a Gaussian of ``width`` samples.

    That of second order is cut off at its ends, so that its sum is not quite zero: on a shaft of
    many turns what is left of the angle itself is more than all its acceleration.
    """
    told = gaussian_filter1d(values, width, order=order)
    if order < 2:
        return told
    left = gaussian_filter1d(np.ones(1), width, order=order, mode='nearest')
    return told - left * gaussian_filter1d(values, width)


def _is_noise(smooth: np.ndarray, raw: np.ndarray, width: float) -> bool:
    """Tell whether a smoothed channel holds no more than white noise as rough leaves in it."""
    rough = float(np.median(np.abs(np.diff(raw, 4)))) / QUARTILE / FOURTH
    return float(np.std(smooth)) <= NOISES * rough / np.sqrt(2.0 * np.sqrt(np.pi) * width)


def bridged(values: np.ndarray) -> np.ndarray:
    """Return a channel with straight lines over what is missing; NaN where nothing is known."""
    known = np.isfinite(values)
    if known.all() or not known.any():
        return values
    rows = np.arange(len(values))
    return np.interp(rows, rows[known], values[known])


def motor_side(at: Signals, ratio: float) -> tuple[str, float] | None:
    """Return the angle that tells the motor's motion, and the factor that brings it there."""
    for name, factor in (('motor_position', 1.0), ('load_position', ratio)):
        if name in at.plain:
            return name, factor
    return None
