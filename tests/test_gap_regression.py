"""Least squares with bounds from sums of products, against scipy's."""

from hypothesis import example, given
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from servo_identify.gap.regression import bounded


def least(table, target, low, high):
    """Return the least sum of squares of ``target + table b`` between the bounds, by scipy."""
    return 2.0 * lsq_linear(table, -target, (low, high), method='bvls', tol=1e-14,
                            max_iter=1000).cost


@given(st.integers(0, 10**6), st.integers(1, 40))
@example(1516, 4)  # whoever holds and frees by turns what is out goes in circles here
@example(15, 6)
@example(204, 10)
def test_it_leaves_the_least_however_alike_columns_are_and_far_apart_their_bounds(seed, size):
    chance = np.random.default_rng(seed)
    table = chance.normal(size=(30, 2)) @ chance.normal(size=(2, size))
    table += 10.0**chance.uniform(-5.0, -0.5) * chance.normal(size=(30, size))
    target = 0.01 * chance.normal(size=30) - table @ chance.normal(size=size)
    low, high = -10.0**chance.uniform(-4.0, 1.0, size), 10.0**chance.uniform(-4.0, 1.0, size)
    b = bounded(table.T @ table, table.T @ target, low, high)
    assert ((low <= b) & (b <= high)).all()
    left = target + table @ b
    assert left @ left <= least(table, target, low, high) * 1.01 + 1e-6


@pytest.mark.parametrize('low, high, expected', [
    (-1.0, 1.0, -1.0), (-10.0, 10.0, -3.0), (-1.0, 1e9, -1.0), (-np.inf, np.inf, -3.0),
    (0.0, 0.0, 0.0), (0.0, 5.0, 0.0), (-2.0, -1.0, -2.0)])
def test_one_unknown_ends_at_its_least_or_at_a_bound(low, high, expected):
    found = bounded(np.array([[2.0]]), np.array([6.0]), np.array([low]), np.array([high]))
    assert found == pytest.approx(expected)


def test_nothing_to_fit_is_nothing():
    assert bounded(np.zeros((0, 0)), np.zeros(0), np.zeros(0), np.zeros(0)).shape == (0,)
    assert bounded(np.zeros((2, 2)), np.zeros(2), -np.ones(2), np.ones(2)).tolist() == [0.0, 0.0]
