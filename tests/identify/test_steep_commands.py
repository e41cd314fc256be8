"""A command that comes late shows however steep it is: unknown instants of rows do not hide it."""

import numpy as np
import pytest

from servo_identify.diagnose.residuals.samples import residual_samples
from servo_twin.description import servo_file
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

PERIOD = 2.5e-3
LATE = 3  # rows
JOINT = servo_file.loads("""
servo: joint
step: 5.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.1}
mechanism: {type: rigid, rotor_inertia: 1.0e-4, load_inertia: 0.03, ratio: 9.0}
sensors: {motor_encoder: {noise: 1.0e-4}, current_sensor: {noise: 0.01}}
effects:
  drags: {effect: viscous_friction, at: load, slope: 0.5}
""")


def a_run(amplitude):
    """Return a recording whose command jumps by ``amplitude`` V, and acts LATE rows late."""
    time, chance = np.arange(0.0, 12.0, PERIOD), np.random.default_rng(4)
    command = amplitude * np.sign(np.sin(5.0 * time))
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['voltage'] = np.concatenate((np.full(LATE, command[0]), command[:-LATE]))
    y = simulate(JOINT, inputs_of(columns), PERIOD, initial_state(JOINT, 0.0, 0.0),
                 'measured_input')
    columns |= {'voltage': command,
                'motor_position': y[:, 0] + chance.normal(0.0, 1e-4, len(y)),
                'current': y[:, 3] + chance.normal(0.0, 0.01, len(y))}
    return Recording(f'steps of {amplitude:g} V', PERIOD, columns, digest='0' * 64)


@pytest.mark.parametrize('amplitude', [2.0, 20.0])
def test_a_late_command_stands_out_however_far_it_jumps(amplitude):
    samples = residual_samples([a_run(amplitude)], JOINT)
    drive = np.abs(samples.base[samples.rows('drive')])
    assert drive.max() > 10.0
