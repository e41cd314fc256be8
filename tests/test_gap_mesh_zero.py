"""The zero of a wind-up with play, which no encoder tells: it ..."""

from dataclasses import replace

import numpy as np
import pytest
from screened import extended, stacked
from synthetic import PERIOD, sampled

from servo_identify.gap.balance import BALANCES
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at

SERVO = servo_file.load(servo_at('geared_dc'))  # with a play of 8 mrad
EXTENDED = extended(SERVO)
TIME = np.arange(6000) * PERIOD


def transmission(*silent, moved=0.0, external=0.01):
    """Return what the mesh leaves of a machine that dwells on one flank, in squares of noise."""
    command = 4.0 * np.sin(6.0 * TIME) + 1.5 * np.sin(17.0 * TIME) + 1.0
    one = sampled(SERVO, command, external=external)
    columns = {**one.columns, 'load_position': one['load_position'] + moved,
               **{name: np.full(len(one), np.nan) for name in silent}}
    stack = stacked([replace(one, columns=columns)], EXTENDED)
    rows = stack.balance == BALANCES.index('transmission')
    assert rows.sum() > 20
    return float(np.mean(stack.base[rows] ** 2))


@pytest.mark.parametrize('moved', [0.0, 3e-3, -0.05])
@pytest.mark.parametrize('silent', [(), ('torque',)])
def test_it_is_found_wherever_the_encoders_have_theirs(silent, moved):
    assert transmission(*silent, moved=moved) < 1.0


@pytest.mark.parametrize('silent', [(), ('torque',)])
def test_it_is_found_of_a_recording_that_never_leaves_one_flank(silent):
    assert transmission(*silent, external=0.5) < 2.0
