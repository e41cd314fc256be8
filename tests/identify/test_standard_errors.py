"""Standard errors with what is known of values without the recordings."""

import numpy as np
import pytest

from servo_identify.fit.fit_problem import Normal
from servo_identify.fit.standard_errors import spread

HORIZONS = 400


def of_a_sum(chance):
    """Return the normal equations of two numbers whose sum alone shows, with noise of one."""
    scores = chance.normal(size=(HORIZONS, 1)) * np.ones(2)
    residual = chance.normal(size=(HORIZONS, 1))
    return Normal(0.5 * float(np.sum(residual**2)), np.zeros(2), HORIZONS * np.ones((2, 2)),
                  scores, np.zeros((HORIZONS, 0, 2)), np.zeros((HORIZONS, 0)), residual)


@pytest.mark.parametrize('known', [0.01, 1.0, 30.0])
def test_a_number_is_as_sure_as_the_data_sheet_is_of_the_other_of_a_sum(known):
    normal, owner = of_a_sum(np.random.default_rng(1)), np.zeros(HORIZONS, dtype=int)
    prior = np.array([0.0, 1.0 / known**2])
    std = np.sqrt(np.diag(spread(normal, owner, np.zeros(2, dtype=bool), prior)))
    assert std[1] == pytest.approx(known, rel=0.05)
    assert std[0] == pytest.approx(np.hypot(known, 1.0 / np.sqrt(HORIZONS)), rel=0.3)


def test_without_a_data_sheet_a_held_number_is_not_known():
    normal, owner = of_a_sum(np.random.default_rng(1)), np.zeros(HORIZONS, dtype=int)
    covariance = spread(normal, owner, np.array([False, True]))
    assert np.sqrt(covariance[0, 0]) == pytest.approx(1.0 / np.sqrt(HORIZONS), rel=0.3)
    assert np.isnan(covariance[1, 1])
