"""What the emulated pan-and-tilt is driven through."""

from __future__ import annotations

from pathlib import Path
import subprocess
import sys

import numpy as np

from servo_identify.experiment.procedures import Run
from servo_twin.description.shipped import shipped
from servo_twin.recording.recording import COLUMNS, Recording

from ..bench_recordings import Part

PERIOD = 1e-3  # s
AZIMUTH, ELEVATION = 'pan_tilt_azimuth', 'pan_tilt_elevation'
STEP, SINE, TONE = 5.0, 3.0, 0.1  # V, V, Hz: figures 8 to 11 of the paper, the tone by its words
STARTS = 0.5  # s, of the step


def _times(seconds: float) -> np.ndarray:
    return np.arange(round(seconds / PERIOD)) * PERIOD


def _run(name: str, family: str, mode: str, reference: np.ndarray,
         external: np.ndarray | float = 0.0) -> Run:
    torque = np.broadcast_to(np.asarray(external, float), reference.shape).copy()
    return Run(name, family, mode, PERIOD, reference, torque)


def _tones(volts: float, last: float, seed: int, seconds: float = 8.0) -> Run:
    """Return many tones at once, up to ``last`` Hz, ``volts`` at their peak."""
    t = _times(seconds)
    chance = np.random.default_rng(seed)
    wave = sum(np.sin(2.0 * np.pi * (f * t + chance.random()))
               for f in np.geomspace(0.25, last, 20))
    return _run(f'tones_{volts:g}V_{seed}', 'multisine', 'voltage',
                volts * wave / np.abs(wave).max())


def _sine(volts: float, tone: float, seconds: float) -> Run:
    return _run(f'sine_{volts:g}V_{tone:g}Hz', 'sine', 'voltage',
                volts * np.sin(2.0 * np.pi * tone * _times(seconds)))


def _slow(speed: float, seconds: float = 8.0) -> Run:
    return _run(f'slow_{speed:g}', 'slow_reversals', 'velocity',
                speed * np.sin(2.0 * np.pi * 0.25 * _times(seconds)))


def _held(torque: float, tone: float, seconds: float = 8.0) -> Run:
    """Return an output that is twisted while the motor holds: the loop of the gear."""
    t = _times(seconds)
    return _run(f'twisted_{torque:g}Nm', 'hold', 'velocity', np.zeros(len(t)),
                torque * np.sin(2.0 * np.pi * tone * t) * np.minimum(1.0, t))


def plan() -> tuple[Part, ...]:
    """Return the recordings of the azimuth, the elevation level and at rest."""
    t = _times(6.0)
    step = _run(f'step_{STEP:g}V', 'square', 'voltage', np.where(t >= STARTS, STEP, 0.0))
    return (
        Part('training', True, (_tones(6.0, 30.0, 1), _sine(2.7, 0.2, 10.0), _slow(0.2),
                                _held(8.0, 0.25)), 100),
        Part('accept', True, (_tones(5.5, 30.0, 3), _slow(0.15), _held(6.0, 0.2)), 200),
        Part('held_out', False, (_tones(5.0, 25.0, 2), _sine(SINE, TONE, 10.0), _slow(0.12),
                                 _held(5.0, 0.4), step), 300))


def both_axes(folder: Path) -> Recording:
    """
    Return a recording of the azimuth while the elevation nods, made by both emulated axes.

    Raises ValueError with what the emulated rigs said when they did not play it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    t = _times(14.0)
    pan = 4.2 * np.sign(np.sin(2.0 * np.pi * 0.25 * t + 1e-9))
    np.savez(folder / 'waves.npz', pan=pan, tilt=0.7 * (1.0 - np.cos(2.0 * np.pi * t / 7.0)))
    made = folder / 'azimuth.npz'
    done = subprocess.run(
        [sys.executable, '-m', 'servo_rig_driver.emulated.coupled_axes',
         '--pan', str(shipped(f'rigs/{AZIMUTH}.yaml')),
         '--tilt', str(shipped(f'rigs/{ELEVATION}.yaml')), '--waves', str(folder / 'waves.npz'),
         '--pan-mode', 'voltage', '--tilt-mode', 'position', '--seed', '400',
         '-o', str(made), str(folder / 'elevation.npz')],
        capture_output=True, text=True, check=False)
    if done.returncode:
        raise ValueError(f'both axes were not played: {done.stderr.strip()[-500:]}')
    with np.load(made) as columns:
        kept = {name: columns[name] for name in COLUMNS if name in columns}
    return Recording('both_axes', PERIOD, kept, family='square', servo=AZIMUTH)
