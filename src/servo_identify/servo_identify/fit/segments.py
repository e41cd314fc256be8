"""
Recordings cut into horizons, each beginning in a state that was measured.

Positions come from the encoders through a zero-phase low pass, speeds from their central
differences. What a recording cannot tell (the memories of effects and of the controller) the
simulation carries on from the horizon before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import inputs_of
from servo_twin.recording.joined_samples import reference_of
from servo_twin.recording.recording import Recording

from .fit_choices import INPUT_OF

CHANNELS = ('motor_position', 'load_position', 'torque', 'current', 'voltage')
"""Columns of what the kernel puts out."""
LEAST = 30
"""Samples of a recording, below which its motion cannot be smoothed."""



@dataclass(frozen=True)
class Course:
    """
    One recording made ready.

    ``inputs`` (samples, 8) for the kernel; ``measured`` (samples, channels) with NaN where there
    is nothing to compare; ``starts`` and ``stops`` of the horizons; ``begin`` (horizons, 8):
    motor angle, load angle, motor speed, load speed, torque, current at each start, NaN where not
    measured, then how much load speed and torque stir there; ``noise`` (5,) one standard
    deviation of each channel.
    """

    recording: Recording
    inputs: np.ndarray
    measured: np.ndarray
    starts: np.ndarray
    stops: np.ndarray
    begin: np.ndarray
    noise: np.ndarray

    @property
    def period(self) -> float:
        """Seconds from sample to sample."""
        return self.recording.period


def courses_of(servo: Servo, recordings: Sequence[Recording], mode: str,
               horizon: float | None, channels: Sequence[str] | None = None) -> tuple[Course, ...]:
    """
    Cut recordings into horizons of ``horizon`` s (None: chosen by the data).

    Raises ValueError when a recording lacks what the mode needs or is too short, nothing moves in
    any of them, or nothing is left to compare.
    """
    if mode not in INPUT_OF:
        raise ValueError(f'there is no mode {mode!r} to fit in; there are {list(INPUT_OF)}')
    if not recordings:
        raise ValueError('there is no recording to fit to')
    if not any(np.ptp(at[np.isfinite(at)]) > 0.0 for at in map(_any_position, recordings)):
        raise ValueError(f'{", ".join(one.name for one in recordings)}: nothing moves, so nothing '
                         'can be fitted; record with a command that moves the machine')
    return tuple(_course(servo, r, mode, horizon, channels) for r in recordings)


def horizon_of(recording: Recording, mode: str) -> float:
    """
    Return the horizon that suits a recording, s.

    One period of its dominant motion, between 0.5 and 2 s: long enough to see friction and
    inertia, short enough not to drift. With the loop closed, or the motor led by its encoder,
    nothing drifts and nothing restarts.
    """
    if mode in ('closed_loop', 'forced_motion'):
        return recording.duration
    position = _any_position(recording)
    speed = np.diff(np.nan_to_num(position))
    speed = speed - speed.mean()
    power = np.abs(np.fft.rfft(speed * np.hanning(len(speed)))) ** 2
    if len(power) < 3 or power[1:].sum() == 0.0:
        return 1.0
    frequency = np.fft.rfftfreq(len(speed), recording.period)
    dominant = frequency[1:][np.searchsorted(np.cumsum(power[1:]), 0.5 * power[1:].sum())]
    return float(np.clip(1.0 / dominant, 0.5, 2.0))


def noise_of(servo: Servo, recording: Recording) -> np.ndarray:
    """
    Noise floor of each channel, shape (5,): as declared, or from third differences.

    Where the machine declares no such sensor, the part of the recording that no smooth motion can
    explain stands for it (third differences of white noise have 20 times its variance).
    """
    floors = []
    for channel in CHANNELS:
        floor = servo.noise(channel)
        if np.isnan(floor) and recording.has(channel) and len(recording) > 10:
            rough = np.diff(recording[channel], 3)
            rough = rough[np.isfinite(rough)]
            floor = float(np.sqrt(np.mean(rough**2) / 20.0)) if len(rough) else np.nan
            span = np.nanmax(recording[channel]) - np.nanmin(recording[channel])
            floor = max(floor, 1e-6 * float(span), 1e-12)
        floors.append(floor)
    return np.array(floors)


def smoothed(signal: np.ndarray, period: float, cutoff: float = 50.0) -> np.ndarray:
    """
    Zero-phase low pass of second order run both ways; NaN stays NaN.

    ``cutoff`` in Hz, at most a fifth of the sampling rate; gaps are bridged by straight lines.
    """
    known = np.isfinite(signal)
    if known.sum() < 30:
        return signal.copy()
    grid = np.arange(len(signal))
    whole = np.interp(grid, grid[known], signal[known])
    sos = butter(2, min(cutoff, 0.2 / period), fs=1.0 / period, output='sos')
    calm = sosfiltfilt(sos, whole)
    calm[~known] = np.nan
    return calm


def _any_position(recording: Recording) -> np.ndarray:
    for name in ('load_position', 'motor_position'):
        if recording.has(name):
            return recording[name]
    raise ValueError(f'{recording.name}: neither motor_position nor load_position is in it')


def _course(servo: Servo, recording: Recording, mode: str, horizon: float | None,
            channels: Sequence[str] | None) -> Course:
    if len(recording) < LEAST:
        raise ValueError(f'{recording.name} has {len(recording)} samples; a fit needs at least '
                         f'{LEAST}')
    needed = reference_of(servo) if mode == 'closed_loop' else INPUT_OF[mode]
    if not needed:
        raise ValueError(f'mode {mode!r} simulates the controller, and {servo.name} has none; '
                         f'other modes are {[m for m in INPUT_OF if m != mode]}')
    if not recording.has(needed):
        raise ValueError(f'{recording.name}: mode {mode!r} needs the column {needed!r}; '
                         f'other modes are {[m for m in INPUT_OF if m != mode]}')
    measured = np.column_stack([recording[c] for c in CHANNELS]).astype(float)
    hidden = {'measured_input': ('voltage',), 'forced_current': ('voltage', 'current'),
              'forced_motion': ('voltage', 'current', 'motor_position',
                                *(() if servo.mechanism.compliant else ('torque',)))}
    for i, channel in enumerate(CHANNELS):
        if channel in hidden.get(mode, ()) or (channels is not None and channel not in channels):
            measured[:, i] = np.nan
    if not np.isfinite(measured).any():
        raise ValueError(f'{recording.name}: no channel is left to compare; asked for '
                         f'{list(channels or CHANNELS)} in mode {mode!r}')
    length = horizon_of(recording, mode) if horizon is None else float(horizon)
    if not length > 2.0 * recording.period:
        raise ValueError(f'horizon = {length:g} s is shorter than three samples of '
                         f'{recording.name} ({recording.period:g} s each)')
    samples = len(recording)
    count = max(1, round(samples * recording.period / length))
    begin = _begin(recording, float(servo.values['mechanism.ratio']))
    edges = _quiet(begin, np.linspace(0, samples, count + 1).astype(int))
    begin = begin[edges[:-1]]
    usable = np.isfinite(begin[:, :2] + begin[:, 2:4]).any(axis=1)  # next to a hole no speed
    if needed == INPUT_OF[mode]:
        given = np.isfinite(recording[needed])
        usable &= np.array([given[a:b].all() for a, b in zip(edges[:-1], edges[1:], strict=True)])
    if not usable.any():
        raise ValueError(f'{recording.name}: every horizon of {length:g} s has a gap in it')
    return Course(recording, inputs_of(recording.columns), measured, edges[:-1][usable],
                  edges[1:][usable], begin[usable], noise_of(servo, recording))


def _quiet(begin: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Move each inner edge, by at most a sixth of a horizon, to where the speed is calmest."""
    reach = max(1, len(begin) // (len(edges) - 1) // 6)
    moved = [edges[0]]
    for edge in edges[1:-1]:
        window = begin[edge - reach:edge + reach + 1, 6]
        moved.append(edge - reach + int(np.argmin(window)))
    return np.array([*moved, edges[-1]])


def _stir(signal: np.ndarray, period: float) -> np.ndarray:
    """Root mean square over 50 ms of what a slower low pass takes away; zero where not known."""
    rough = np.nan_to_num(signal - smoothed(signal, period, 8.0)) ** 2
    width = max(1, round(0.05 / period))
    return np.sqrt(np.convolve(rough, np.ones(width) / width, 'same'))


def _begin(recording: Recording, ratio: float) -> np.ndarray:
    angles = [smoothed(recording[c], recording.period)
              for c in ('motor_position', 'load_position')]
    speeds = [np.gradient(angle, recording.period) for angle in angles]
    torque = smoothed(recording['torque'], recording.period)
    own = speeds[1] if recording.has('load_position') else speeds[0] / ratio
    return np.column_stack([*angles, *speeds, torque, recording['current'],
                            _stir(own, recording.period), _stir(torque, recording.period)])
