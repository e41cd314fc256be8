"""Which causes the recordings ask for, where one by one is not enough."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from screened import chosen_of, names_of, twice, with_effects

from servo_identify.gap.balance import BALANCES
from servo_identify.gap.selection import Selection
from servo_identify.gap.stack import Beside


class Hasty(Selection):
    """A search that stops at the first cause, as where nothing more looks worth it beside it."""

    def _grown(self, chosen, tick):
        first = [c for c, one in enumerate(self.screening.library.candidates)
                 if one.name == 'load_dependent_friction']
        return super()._grown(chosen, tick) if chosen else first


def test_a_search_ends_where_what_came_falls_again():
    asked = []

    class Fickle(Selection):
        def _tidied(self, chosen, least):
            asked.append(chosen)
            assert len(asked) < 20, 'it goes on for ever'
            return chosen[:1]

    rig = with_effects(('gravity', 'load', {'sine': 12.0, 'cosine': 4.8}),
                       ('asymmetric_friction', 'load', {'difference': 30.0, 'slope': 0.0}))
    screening = twice(rig, 'asymmetric_friction', 'gravity')
    assert len(Fickle(screening)._grown([], lambda share: None)) == 1
    assert [len(chosen) for chosen in asked] == [1, 2]


def test_two_causes_are_found_behind_a_third_that_does_a_part_of_both():
    rig = with_effects(('gravity', 'load', {'sine': 12.0, 'cosine': 4.8}),
                       ('asymmetric_friction', 'load', {'difference': 30.0, 'slope': 0.0}))
    screening = twice(rig, 'asymmetric_friction', 'gravity', 'spring_load',
                      'load_dependent_friction')
    chosen = Hasty(screening).select(lambda share: None)
    assert set(names_of(screening, chosen)) == {'asymmetric_friction', 'gravity'}


@given(st.floats(-0.4, 0.4))
@settings(deadline=None, max_examples=5)
def test_a_spring_is_found_wherever_on_the_way_it_has_its_zero(rest):
    rig = with_effects(('spring_load', 'load', {'stiffness': 60.0, 'rest': rest}))
    screening = twice(rig, 'asymmetric_friction', 'gravity', 'spring_load')
    assert names_of(screening, chosen_of(screening)) == ['spring_load']


@given(width=st.floats(5e-5, 1.2e-3), stiffness=st.floats(4.3e5, 5.7e5))
@settings(deadline=None, max_examples=6)
def test_a_gap_is_told_from_a_bent_spring_by_any_stiffness_that_the_file_allows(width, stiffness):
    """A stiffness that is off says nothing inside the gap, and a bent spring made up for that."""
    rig = with_effects(('backlash', 'mesh', {'width': width})).with_values(
        {'mechanism.stiffness': stiffness})
    screening = twice(rig, 'backlash', 'nonlinear_stiffness', 'load_dependent_backlash')
    assert names_of(screening, chosen_of(screening)) == ['backlash']


def test_the_columns_of_a_gap_and_what_is_beside_it_make_up_the_residual_in_full():
    rig = with_effects(('backlash', 'mesh', {'width': 4e-4})).with_values(
        {'mechanism.stiffness': 5.6e5})
    screening = twice(rig, 'backlash')
    gap = next(one for one in screening.library.candidates if one.name == 'backlash')
    slot = screening.stack.extended.servo.slots()['mechanism.stiffness'].start
    column = screening.stack.derivative('mechanism.stiffness', 0, 1e4)
    theta, on = screening.stack.with_shapes(gap)
    theta[slot] += 6e4
    beside = Beside(theta.copy(), screening.stack.base + 6e4 * column)
    width = np.array([4e-4])
    theta[screening.stack.extended.slot(gap.paths[0])] += width[0]
    whole = beside.residual + screening.stack.columns(gap, width, beside) @ width
    rows = screening.stack.balance == BALANCES.index('transmission')
    assert whole[rows] == pytest.approx(screening.stack.at(theta, on)[rows], abs=1e-9)
    apart = beside.residual + screening.stack.columns(gap, width) @ width
    assert np.abs(apart - whole)[rows].max() > 10.0


def test_what_was_taken_for_what_fell_falls_too():
    """Readings and torque constant off by as much are a scale of all torques, but not each."""
    rig = with_effects(('gravity', 'load', {'sine': 12.0, 'cosine': 4.8}))
    screening = twice(rig, 'gravity', 'asymmetric_friction')
    chosen = chosen_of(screening)
    needless = next(number for number, one in enumerate(screening.library.candidates)
                    if one.name == 'torque_constant_error')
    pruned = Selection(screening).pruned([needless, *chosen])
    assert pruned == chosen and names_of(screening, chosen) == ['gravity']


def test_a_ripple_is_found_that_shows_only_once_what_is_far_larger_is_fitted():
    rig = with_effects(('cogging', 'motor', {'order': 7.0, 'sine': (0.02,), 'cosine': (0.0,)})
                       ).with_values({'drive.torque_constant': 0.57})
    screening = twice(rig, 'cogging')
    assert 7.0 not in orders_of(screening, range(len(screening.library.candidates)))
    chosen = chosen_of(screening)
    assert names_of(screening, chosen) == ['torque_constant_error', 'cogging']
    assert orders_of(screening, chosen) == {7.0}


def orders_of(screening, some):
    """Return the orders that candidates have."""
    return {value for c in some for path, value in screening.library.candidates[c].shapes
            if path.endswith('.order')}


@pytest.mark.parametrize('share', [0.05, -0.08])
def test_of_two_causes_that_do_as_well_the_one_is_taken_that_leaves_values_where_they_were(share):
    gain = with_effects().values['drive.gain'] * (1.0 + share)
    screening = twice(with_effects().with_values({'drive.gain': gain}), 'current_sensor_gain')
    assert names_of(screening, chosen_of(screening)) == ['parameter:gain']
