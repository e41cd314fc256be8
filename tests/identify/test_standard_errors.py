"""Standard errors with what is known of values without the recordings."""

from dataclasses import replace

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


def test_few_horizons_do_not_call_all_numbers_one():
    chance = np.random.default_rng(2)
    scores = chance.normal(size=(1, 3))
    residual = chance.normal(size=(50, 1))
    normal = Normal(1.0, np.zeros(3), 50.0 * np.eye(3), scores, np.zeros((1, 0, 3)),
                    np.zeros((1, 0)), residual)
    covariance = spread(normal, np.zeros(1, dtype=int), np.zeros(3, dtype=bool))
    std = np.sqrt(np.diag(covariance))
    assert np.abs(covariance / np.outer(std, std) - np.eye(3)).max() < 0.1


def test_a_step_that_is_left_to_go_goes_along_what_is_not_told_apart():
    normal, owner = of_a_sum(np.random.default_rng(1)), np.zeros(HORIZONS, dtype=int)
    left = replace(normal, gradient=np.array([1.0, -1.0]),
                   hessian=HORIZONS * np.array([[1.0, 0.999], [0.999, 1.0]]))
    covariance = spread(left, owner, np.zeros(2, dtype=bool))
    std = np.sqrt(np.diag(covariance))
    assert covariance[0, 1] / np.prod(std) < -0.9
