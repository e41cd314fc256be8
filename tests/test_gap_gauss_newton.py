"""Least squares within bounds, against scipy's."""

from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
import numpy as np
from scipy.optimize import least_squares, lsq_linear

from servo_identify.gap.gauss_newton import gauss_newton

NUMBERS = st.floats(-3.0, 3.0).map(lambda x: round(x, 3))


@given(arrays(float, (12, 4), elements=NUMBERS), arrays(float, 12, elements=NUMBERS),
       arrays(float, 4, elements=st.floats(0.0, 1.0)))
def test_a_linear_problem_is_solved_between_its_bounds(table, target, where):
    low, high = -np.full(4, 0.2), np.array([0.1, 0.5, 1.0, 20.0])
    x, left, slopes = gauss_newton(lambda x: table @ x - target, lambda x: table,
                                   low + where * (high - low), low, high)
    best = lsq_linear(table, target, (low, high), method='bvls')
    assert ((low <= x) & (x <= high)).all()
    np.testing.assert_allclose(left, table @ x - target)
    assert left @ left <= 2.0 * best.cost * (1.0 + 1e-3) + 1e-6


def decays(times):
    """Return (what two exponentials leave of a measured decay, its slopes)."""
    measured = 2.0 * np.exp(-times / 0.3) + 0.7 * np.exp(-times / 2.0)

    def left(x):
        return x[0] * np.exp(-times / x[1]) + x[2] * np.exp(-times / x[3]) - measured

    def slopes(x):
        one, two = np.exp(-times / x[1]), np.exp(-times / x[3])
        return np.column_stack((one, x[0] * one * times / x[1]**2,
                                two, x[2] * two * times / x[3]**2))
    return left, slopes


@given(st.floats(0.1, 4.0), st.floats(0.1, 0.9), st.floats(0.1, 4.0), st.floats(1.1, 8.0),
       st.floats(0.3, 3.0))
def test_it_is_never_worse_than_its_start_and_keeps_its_bounds(a, s, b, t, most):
    left, slopes = decays(np.linspace(0.0, 4.0, 60))
    low, high = np.array([0.0, 0.05, 0.0, 1.0]), np.array([most, 1.0, most, 9.0])
    start = np.clip([a, s, b, t], low, high)
    x, rest, _ = gauss_newton(left, slopes, start, low, high)
    assert ((low <= x) & (x <= high)).all()
    np.testing.assert_array_equal(rest, left(x))
    assert rest @ rest <= left(start) @ left(start)


def test_it_finds_what_scipy_finds_where_a_bound_holds_with_far_fewer_slopes():
    left, slopes = decays(np.linspace(0.0, 4.0, 200))
    low, high = np.array([0.0, 0.05, 0.0, 1.0]), np.array([1.5, 1.0, 3.0, 9.0])
    asked = []

    def counted(x):
        asked.append(x)
        return slopes(x)
    start = np.array([1.0, 0.5, 1.0, 4.0])
    x, rest, _ = gauss_newton(left, counted, start, low, high)
    best = least_squares(left, start, slopes, bounds=(low, high), ftol=1e-12, xtol=1e-12)
    np.testing.assert_allclose(x, best.x, rtol=0.02)
    assert rest @ rest <= 2.02 * best.cost
    assert x[0] == 1.5
    assert len(asked) < best.njev
