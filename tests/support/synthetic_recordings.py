"""Recordings simulated from the twin's own laws, whose truth is known."""

from collections.abc import Mapping

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

PERIOD = 1e-3


def sampled(servo: Servo, voltage: np.ndarray, *, seed: int = 0, external: float = 0.0,
            late: Mapping[str, float] | None = None, period: float = PERIOD) -> Recording:
    """Record a servo under a command, with the noise of its sensors; ``late`` in samples."""
    rng = np.random.default_rng(seed)
    samples = len(voltage)
    columns = {name: np.full(samples, np.nan) for name in COLUMNS}
    columns['voltage'] = np.asarray(voltage, dtype=float)
    columns['external_torque'] = np.full(samples, external)
    ratio = servo.values['mechanism.ratio']
    y = simulate(servo, inputs_of(columns), period, initial_state(servo, 0.3 * ratio, 0.3))
    for i, name in enumerate(('motor_position', 'load_position', 'torque', 'current')):
        grid = np.arange(samples)
        clean = np.interp(grid - (late or {}).get(name, 0.0), grid, y[:, i])
        columns[name] = clean + servo.noise(name) * rng.standard_normal(samples)
    return Recording(f'synthetic {seed}', period, columns, digest=f'{seed:064d}')


def from_rest(servo: Servo, command: np.ndarray, period: float, chance: np.random.Generator,
              ahead: float = 0.0) -> Recording:
    """
    Record the motor's encoder and the current of a servo from rest under a command, with noise.

    The current is read ``ahead`` sample periods after its row.
    """
    samples = len(command)
    columns = {name: np.full(samples, np.nan) for name in COLUMNS} | {'voltage': command}
    y = simulate(servo, inputs_of(columns), period, initial_state(servo, 0.0, 0.0),
                 'measured_input')
    current = (1.0 - ahead) * y[:, 3] + ahead * np.append(y[1:, 3], y[-1, 3])
    columns |= {name: clean + chance.normal(0.0, servo.noise(name), samples) for name, clean in (
        ('motor_position', y[:, 0]), ('current', current))}
    return Recording('from rest', period, columns, digest='0' * 64)


def run_of(number: int, period: float, known: Mapping[str, np.ndarray], family: str) -> Recording:
    """Return a recording ``run_NUMBER`` of the columns that a logger had; the others are NaN."""
    samples = len(next(iter(known.values())))
    return Recording(f'run_{number}', period, {
        name: known.get(name, np.full(samples, np.nan)) for name in COLUMNS}, family=family)
