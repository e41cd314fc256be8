"""A bridge that loses volts by the sign of its current, before a winding with an inductance."""

import numpy as np
import pytest

from servo_twin.description import servo_file
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS

VOLTS, OHMS, HENRY, ROUND, PERIOD = 0.4, 1.6, 8e-4, 0.1, 1e-3
FILE = """
servo: locked
step: STEP
drive: {type: voltage, resistance: 1.6, inductance: 8.0e-4, back_emf: 0.05, torque_constant: 0.05}
mechanism: {type: rigid, rotor_inertia: 1.0e+3, load_inertia: 0.0, ratio: 1.0}
sensors: {motor_encoder: {noise: 1.0e-3}}
effects:
  bridge: {effect: drive_dead_time, at: current, loss: 0.25, rounding: 0.1, settling: 5.0e-4}
"""


def integrated(command, steps=2000):
    """Return the current at the start of each row, A, by steps that are short against L / R."""
    current, rows, h = 0.0, [], PERIOD / steps
    for volts in command:
        rows.append(current)
        for _ in range(steps):
            lost = VOLTS * min(max(current / ROUND, -1.0), 1.0)
            current += h / HENRY * (volts - lost - OHMS * current)
    return np.array(rows)


@pytest.mark.parametrize(('step', 'near'), [('1.0e-5', 0.01), ('1.0e-3', 0.3)])
def test_it_takes_the_same_volts_at_any_step(step, near):
    servo = servo_file.loads(FILE.replace('STEP', step))
    command = np.repeat([3.0, -1.5, 0.3, -0.2, 0.0, 2.0], 8)
    columns = {name: np.full(len(command), np.nan) for name in COLUMNS} | {'voltage': command}
    current = simulate(servo, inputs_of(columns), PERIOD, initial_state(servo, 0.0, 0.0))[:, 3]
    expected = integrated(command)
    settled = slice(7, None, 8)
    assert current[settled] == pytest.approx(expected[settled], abs=2e-3)
    assert current == pytest.approx(expected, abs=near * np.abs(expected).max())
