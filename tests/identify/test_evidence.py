"""What chance gains, and how the evidence of equations and simulation is weighed."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from servo_identify.diagnose.handover.gap import Gap
from servo_identify.diagnose.selection.bounded_least_squares import most_gained


@given(seed=st.integers(0, 10**6), unknowns=st.integers(1, 6))
def test_what_is_gained_within_bounds_is_the_larger_of_both_signs(seed, unknowns):
    random = np.random.default_rng(seed)
    table, target = random.normal(size=(20, unknowns)), random.normal(size=20)
    gram, slope = table.T @ table, table.T @ target
    zero, inf = np.zeros(unknowns), np.full(unknowns, np.inf)
    gained = most_gained(gram, slope[None, :], np.array([zero, -inf]), np.array([inf, zero]))
    best = max(0.5 * target @ target - lsq_linear(table, target, bounds=bounds).cost
               for bounds in ((0.0, np.inf), (-np.inf, 0.0)))
    assert gained[0] == pytest.approx(best, abs=1e-6)


def gap(motor, torsion, blocks=10):
    """Return a gap with these errors of two channels, each alike in all blocks."""
    squares = {name: np.column_stack((np.full(blocks, 100 * error**2), np.full(blocks, 100)))
               for name, error in (('motor_position', motor), ('torsion', torsion))}
    return Gap(squares, dict.fromkeys(squares, 1e-6), dict.fromkeys(squares, 1.0),
               np.zeros(blocks, dtype=int))


@given(factor=st.floats(0.1, 10.0), size=st.floats(1e-3, 1e3))
def test_evidence_counts_each_channel_in_proportion_and_blocks_as_observations(factor, size):
    assert gap(factor, size * factor).evidence(gap(1.0, size)) == pytest.approx(
        10 * np.log(factor), abs=1e-9)
    assert gap(factor, size).evidence(gap(1.0, size * factor)) == pytest.approx(0.0, abs=1e-9)


@given(left=st.floats(1e-4, 0.09), other=st.floats(1e-4, 0.09), size=st.floats(1e-3, 1e3))
def test_what_the_best_form_of_an_effect_may_leave_tells_no_two_forms_apart(left, other, size):
    whole = gap(size, size)
    small, smaller = (gap(share * size, share * size) for share in (left, other))
    assert small.evidence(smaller, whole) == pytest.approx(0.0, abs=1e-9)
    assert whole.evidence(small, whole) == pytest.approx(10 * np.log(10.0), abs=1e-6)
