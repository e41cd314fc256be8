"""A compliant machine of which one shaft is measured: what is made of the other one."""

from dataclasses import replace

import numpy as np
import pytest
from screened import extended, stacked
from synthetic import PERIOD, sampled

from servo_identify.gap import observation
from servo_identify.gap.balance import BALANCES
from servo_twin import servo_file
from servo_twin.shipped import servo_at

RV = servo_file.load(servo_at('rv_plain'))
WITH_PLAY = servo_file.load(servo_at('geared_dc'))
TIME = np.arange(6000) * PERIOD
SILENT = {'motor': ('load_position', 'torque'), 'load': ('motor_position', 'torque')}


def gap(twin, rig, shaft, size):
    """Return the mean square of the torque balance, in noise, doubt and practical margin."""
    command = size * (np.sin(5.0 * TIME) + 0.6 * np.sin(31.0 * TIME) + 0.4 * np.sin(90.0 * TIME))
    one = sampled(rig, command)
    nothing = np.full(len(one), np.nan)
    stack = stacked([replace(one, columns={**one.columns, **dict.fromkeys(
        SILENT[shaft], nothing)})], extended(twin))
    rows = stack.balance == BALANCES.index('torque')
    assert rows.sum() > 50
    return float(np.mean(stack.base[rows] ** 2))


@pytest.mark.parametrize('shaft', ['motor', 'load'])
@pytest.mark.parametrize(('servo', 'size'), [(RV, 2.0), (WITH_PLAY, 4.0)])
def test_a_load_that_swings_on_its_mesh_is_no_gap(servo, size, shaft, monkeypatch):
    swinging = gap(servo, servo, shaft, size)
    monkeypatch.setattr(observation, 'wound_up', lambda one, servo: np.zeros(len(one)))
    assert swinging < 2.5 and swinging < 0.3 * gap(servo, servo, shaft, size)


@pytest.mark.parametrize(('path', 'value'), [
    ('effects.load_coulomb.level', 30.0), ('effects.load_viscous.slope', 40.0),
    ('mechanism.load_inertia', 8.0)])
def test_what_the_machine_lacks_still_shows(path, value):
    assert gap(RV, RV.with_values({path: value}), 'motor', 2.0) > 2.0
