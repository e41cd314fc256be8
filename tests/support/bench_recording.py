"""A recording of the bench that its own servo file drives, for the tests of replay and page."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from servo_twin.description.servo_file import dumps, load
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, PREDICTED, Recording

SERVO = Path(__file__).resolve().parents[2] / 'config' / 'servos' / 'rv_bench.yaml'


def bench_recording(seconds: float = 2.0, coulomb: float = 22.0, start: float = 100.0,
                    sequence: int = 17, of: Servo | None = None) -> Recording:
    """
    Return two sines of load speed of a bench with this Coulomb friction (N m) and noise.

    ``of``: the servo that it is made of and holds, if it is not the shipped one.
    """
    period = 1e-3
    servo = load(SERVO) if of is None else of
    rig = servo.with_values({'effects.coulomb.level': coulomb})
    time = np.arange(round(seconds / period)) * period
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['reference_velocity'] = 0.3 * np.sin(4.0 * time) + 0.2 * np.sin(13.0 * time)
    y = simulate(rig, inputs_of(columns), period, initial_state(rig), 'closed_loop')
    columns.update(zip(PREDICTED, y.T.copy(), strict=True))
    random = np.random.default_rng(5)
    for name in ('motor_position', 'load_position', 'torque', 'current'):
        columns[name] += servo.noise(name) * random.standard_normal(len(time))
    return Recording('bench', period, columns, start=start, family='sine', servo='rv_bench',
                     servo_file=dumps(servo), sequence=sequence)


def without(recording: Recording, rows: slice) -> Recording:
    """Return the recording with samples lost on their way: all columns NaN in ``rows``."""
    columns = {name: values.copy() for name, values in recording.columns.items()}
    for values in columns.values():
        values[rows] = np.nan
    return replace(recording, columns=columns)
