"""Speed and acceleration as the check of the data takes them, of a shaft of many turns."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from synthetic_recordings import run_of

from servo_identify.data.excitation import WIDTHS
from servo_identify.data.signals import signals

PERIOD = 1e-3
TIME = np.arange(1600) * PERIOD


def channels(angle, width):
    return signals(run_of(0, PERIOD, {'motor_position': angle}, 'sweep'), width)


@settings(max_examples=30)
@given(width=st.sampled_from(WIDTHS), turns=st.floats(-500.0, 500.0),
       speed=st.floats(-100.0, 100.0), faster=st.floats(-50.0, 50.0))
def test_they_do_not_depend_on_how_far_the_shaft_has_turned(width, turns, speed, faster):
    told = channels(2.0 * np.pi * turns + speed * TIME + 0.5 * faster * TIME**2, width)
    acceleration, motion = told.acceleration['motor_position'], told.speed['motor_position']
    assert acceleration == pytest.approx(np.full(len(told), faster), rel=0.02, abs=1e-3)
    assert np.mean(motion) == pytest.approx(speed + faster * np.mean(TIME), rel=0.01, abs=0.02)
