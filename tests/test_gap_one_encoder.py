"""A compliant machine of which one shaft is measured: what is made of the other one."""

from dataclasses import replace

import numpy as np
import pytest
from screened import extended, stacked
from synthetic import PERIOD, sampled

from servo_identify.gap import observation
from servo_identify.gap.balance import BALANCES
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at

RV = servo_file.load(servo_at('rv_plain'))
WITH_PLAY = servo_file.load(servo_at('geared_dc'))
TIME = np.arange(6000) * PERIOD
OTHER = {'motor': 'load_position', 'load': 'motor_position'}


def gap(twin, rig, shaft, size, torque=False):
    """Return the largest mean square of a torque balance, in noise, doubt and margin."""
    command = size * (np.sin(5.0 * TIME) + 0.6 * np.sin(31.0 * TIME) + 0.4 * np.sin(90.0 * TIME))
    one = sampled(rig, command)
    nothing = np.full(len(one), np.nan)
    silent = (OTHER[shaft],) if torque else (OTHER[shaft], 'torque')
    stack = stacked([replace(one, columns={**one.columns, **dict.fromkeys(silent, nothing)})],
                    extended(twin))
    squares = []
    for name in ('motor', 'load') if torque else ('torque',):
        rows = stack.balance == BALANCES.index(name)
        assert rows.sum() > 50
        squares.append(float(np.mean(stack.base[rows] ** 2)))
    return max(squares)


@pytest.mark.parametrize('torque', [False, True])
@pytest.mark.parametrize('shaft', ['motor', 'load'])
@pytest.mark.parametrize(('servo', 'size'), [(RV, 2.0), (WITH_PLAY, 4.0)])
def test_a_load_that_swings_on_its_mesh_is_no_gap(servo, size, shaft, torque, monkeypatch):
    swinging = gap(servo, servo, shaft, size, torque)
    monkeypatch.setattr(observation, 'wound_up', lambda one, servo: np.zeros(len(one)))
    assert swinging < 3.5 and swinging < 0.3 * gap(servo, servo, shaft, size, torque)


@pytest.mark.parametrize(('path', 'value'), [
    ('effects.load_coulomb.level', 30.0), ('effects.load_viscous.slope', 40.0),
    ('mechanism.load_inertia', 8.0)])
def test_what_the_machine_lacks_still_shows(path, value):
    assert gap(RV, RV.with_values({path: value}), 'motor', 2.0) > 2.0


@pytest.mark.parametrize(('shaft', 'judged'), [('motor', True), ('load', False)])
def test_a_controller_is_judged_by_the_encoder_that_it_reads(shaft, judged):
    one = sampled(RV, 2.0 * np.sin(31.0 * TIME))
    columns = {**one.columns, OTHER[shaft]: np.full(len(one), np.nan),
               'reference_velocity': np.sin(31.0 * TIME)}
    balance = stacked([replace(one, columns=columns)], extended(RV)).balances[0]
    assert ('controller' in balance.names) == judged
