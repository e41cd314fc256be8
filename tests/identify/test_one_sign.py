"""A current or a command without its sign: the check ..."""

from dataclasses import replace

import numpy as np
import pytest
from test_shown_factor import AXIS, run

from servo_identify.data.recording_check import check


def said(one):
    return [found for found in check([one], AXIS) if found.level == 'red'
            and 'it is a magnitude, or that of the supply' in found.sentence]


@pytest.fixture(scope='module')
def good():
    return run()


@pytest.mark.parametrize('spoil', [np.abs, lambda current: -np.abs(current)])
def test_it_tells_a_magnitude_by_the_equation_of_the_drive(good, spoil):
    found, = said(replace(good, columns={**good.columns, 'current': spoil(good['current'])}))
    assert 'of the equation of the drive' in found.sentence and 'current=' in found.action


def test_it_tells_a_pwm_whose_direction_is_in_another_column(good):
    found, = said(replace(good, columns={**good.columns, 'voltage': np.abs(good['voltage'])}))
    assert 'ask for the command' in found.sentence and 'dir' in found.action


def test_it_leaves_a_command_that_pushes_one_way(good):
    one_way = {**good.columns, 'voltage': good['voltage'] - np.nanmin(good['voltage'])}
    assert not said(replace(good, columns=one_way))


def test_it_leaves_a_current_that_only_begins_at_zero(good):
    current = good['current'] - np.nanmin(good['current'])
    assert not said(good) and not said(
        replace(good, columns={**good.columns, 'current': current}))
