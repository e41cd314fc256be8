"""A wave behind the controller, found in closed-loop recordings that do not hold it: it ..."""

from pathlib import Path

import numpy as np
import pytest

from servo_identify.diagnose.residuals.added_input import added_input
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_twin.description import servo_file
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import OUTPUTS
from servo_twin.recording.recording import COLUMNS, Recording

CONFIG = Path(__file__).resolve().parents[2] / 'config'
SERVO = servo_file.load(CONFIG / 'servos' / 'rv_bench.yaml')
PERIOD, SECONDS = 1e-3, 12.0
TIME = np.arange(int(SECONDS / PERIOD)) * PERIOD
REFERENCE = {'reference_velocity': 0.4 * np.sin(2.0 * np.pi * 0.4 * TIME)
             + 0.2 * np.sin(2.0 * np.pi * 0.23 * TIME)}


def recorded(rig, added=None):
    """Return what is recorded of a closed loop; what is added to its command is not."""
    known = REFERENCE | {n: np.full(len(TIME), np.nan) for n in COLUMNS if n not in REFERENCE}
    inputs = inputs_of(known if added is None else {**known, 'added_command': added})
    y = simulate(rig, inputs, PERIOD, initial_state(rig, 0.0, 0.0), 'closed_loop')
    columns = dict(zip(OUTPUTS, y.T, strict=True)) | REFERENCE
    return Recording('run', PERIOD, {n: np.ascontiguousarray(c) for n, c in columns.items()})


def found(recording):
    return added_input(residual_samples([recording], SERVO).errors)


@pytest.mark.long
@pytest.mark.parametrize(('shape', 'wave'), [
    ('square wave', lambda phase: 1.5 + np.where(phase % 1.0 < 0.5, 0.8, -0.8)),
    ('sine', lambda phase: 0.8 * np.sin(2.0 * np.pi * phase))])
def test_it_is_described_by_shape_period_and_amplitude(shape, wave):
    told = found(recorded(SERVO, wave(TIME / 1.3)))
    assert told.shape == shape
    assert told.period == pytest.approx(1.3, rel=1e-3)
    assert told.amplitude == pytest.approx(0.8, rel=0.05)
    assert told.offset == pytest.approx(1.5 if shape == 'square wave' else 0.0, abs=0.05)
    assert f'{shape} of 0.' in str(told) and f'period {told.period:.3f} s' in str(told)


def test_it_is_not_seen_where_nothing_is_added_or_the_controller_has_other_gains():
    assert found(recorded(SERVO)) is None
    other = SERVO.with_values({p: 1.3 * float(v) for p, v in SERVO.values.items()
                               if p in ('controller.kp', 'controller.ki')})
    assert found(recorded(other)) is None
