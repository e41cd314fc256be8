"""What a twin makes of a recording that nobody has made yet, or of the inputs of one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from servo_twin.physics.servo import Servo, ServoError
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS, OUTPUTS

DURATION = 10.0  # s of each candidate


def simulated(servo: Servo, family: str, settings: dict[str, Any],
              period: float) -> dict[str, Any] | None:
    """Return what a twin makes of a candidate, from rest; None where it cannot run it."""
    samples = int(DURATION / period)
    t = np.arange(samples) * period
    columns = {name: np.full(samples, np.nan) for name in INPUTS}
    mode = mode_of(settings)
    reference, columns['external_torque'] = _waves(family, settings, t)
    if mode == 'closed_loop':
        columns['reference_velocity'] = reference
        columns['reference_position'] = np.cumsum(reference) * period
    else:
        columns['voltage'] = reference
    return run(servo, columns, period, mode)


def mode_of(settings: Mapping[str, Any]) -> str:
    """Return how a twin runs a candidate: by the command, or by its controller."""
    return 'measured_input' if 'amplitude' in settings else 'closed_loop'


def run(servo: Servo, columns: Mapping[str, np.ndarray], period: float, mode: str,
        start: tuple[float, float] = (np.nan, np.nan)) -> dict[str, Any] | None:
    """Return what a twin makes of inputs, from rest at two angles; None where it cannot."""
    try:
        y = simulate(servo, inputs_of(columns), period, initial_state(servo, *start), mode)
    except ServoError:
        return None
    if not np.isfinite(y[:, :4]).all():
        return None
    return dict(zip(OUTPUTS, y.T, strict=True)) | {'period': period}


def _waves(family: str, settings: dict[str, Any], t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return reference (V, or rad/s at the load) and external torque, N m, shape of t each."""
    still = np.zeros(len(t))
    if family == 'slow_reversals':
        phase = 2.0 * np.pi * t / settings['period']
        return settings['speed'] * 2.0 / np.pi * np.arcsin(np.sin(phase)), still
    if family == 'sine':
        return settings['amplitude'] * np.sin(2.0 * np.pi * settings['frequency'] * t), still
    if family == 'chirp':
        rate = np.log(settings['to'] / settings['from']) / DURATION
        turns = settings['from'] * np.expm1(rate * t) / rate
        return settings['amplitude'] * np.sin(2.0 * np.pi * turns), still
    if family == 'multisine':
        tones = np.geomspace(settings['from'], settings['to'], settings['lines'])
        wave = sum(np.sin(2.0 * np.pi * f * t + 1.7 * i * i) for i, f in enumerate(tones))
        return settings['amplitude'] * wave / np.abs(wave).max(), still
    if family == 'speed_ladder':
        levels = np.repeat(settings['speeds'], 2)
        place = np.minimum((t / DURATION * len(levels)).astype(int), len(levels) - 1)
        speed, torque = levels[place] * np.where(place % 2, -1.0, 1.0), still
    else:  # load_steps
        levels = np.linspace(-1.0, 1.0, 5)
        cycle = np.concatenate((levels, levels[-2:0:-1]))
        place = (t / 0.5).astype(int)
        speed = settings['speed'] * np.where(place // len(cycle) % 2, -1.0, 1.0)
        torque = settings['torque'] * cycle[place % len(cycle)]
    return _eased(speed, settings['acceleration'] * (t[1] - t[0])), torque


def _eased(wanted: np.ndarray, most: float) -> np.ndarray:
    """Return a speed that follows another one from rest, by ``most`` from sample to sample."""
    eased, now = np.empty(len(wanted)), 0.0
    for i, speed in enumerate(wanted):
        now += min(max(speed - now, -most), most)
        eased[i] = now
    return eased
