"""What repeats along an axis that moves straight has any period: no turn says which."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from servo_identify.diagnose.mechanisms.orders import along_travel


@settings(max_examples=25, deadline=None)
@given(waves=st.floats(3.0, 450.0), travel=st.floats(0.02, 2.0), seed=st.integers(0, 99))
def test_the_period_of_cogging_is_found_wherever_it_lies(waves, travel, seed):
    chance = np.random.default_rng(seed)
    x = 0.5 * travel * np.sin(np.linspace(0.0, 40.0, 12000))
    order = 2.0 * np.pi * waves / travel
    target = np.cos(order * x + 0.7) + 0.5 * chance.standard_normal(len(x))
    found, tried = along_travel(x, target, np.ones(len(x)), 1.0)
    assert found[0] == pytest.approx(order, abs=0.2 * 2.0 * np.pi / travel)
    assert tried > 200


def test_no_period_is_told_that_the_encoder_does_not_tell():
    x = 0.3 * np.sin(np.linspace(0.0, 40.0, 12000))
    target = np.cos(500.0 * x) + 0.1 * np.cos(60.0 * x)
    found, _ = along_travel(x, target, np.ones(len(x)), 1.0, largest=300.0)
    assert found[0] == pytest.approx(60.0, abs=1.0)
