"""A command that comes late shows however steep it is: unknown instants of rows do not hide it."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recordings import from_rest
from test_simulated_gap import JOINT

from servo_identify.diagnose.residuals.samples import residual_samples

PERIOD = 2.5e-3
LATE = 3  # rows


def a_run(amplitude):
    """Return a recording whose command jumps by ``amplitude`` V, and acts LATE rows late."""
    command = amplitude * np.sign(np.sin(5.0 * np.arange(0.0, 12.0, PERIOD)))
    acts = np.concatenate((np.full(LATE, command[0]), command[:-LATE]))
    run = from_rest(JOINT, acts, PERIOD, np.random.default_rng(4))
    return replace(run, columns=run.columns | {'voltage': command})


@pytest.mark.parametrize('amplitude', [2.0, 20.0])
def test_a_late_command_stands_out_however_far_it_jumps(amplitude):
    samples = residual_samples([a_run(amplitude)], JOINT)
    drive = np.abs(samples.base[samples.rows('drive')])
    assert drive.max() > 10.0
