"""Which causes the recordings ask for, where one by one is not enough."""

from hypothesis import given, settings
from hypothesis import strategies as st
from screened import chosen_of, names_of, twice, with_effects

from servo_identify.gap.selection import Selection


class Hasty(Selection):
    """A search that stops at the first cause, as where nothing more looks worth it beside it."""

    def _grown(self, chosen, tick):
        first = [c for c, one in enumerate(self.screening.library.candidates)
                 if one.name == 'load_dependent_friction']
        return super()._grown(chosen, tick) if chosen else first


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


def test_what_was_taken_for_what_fell_falls_too():
    """Readings and torque constant off by as much are a scale of all torques, but not each."""
    rig = with_effects(('gravity', 'load', {'sine': 12.0, 'cosine': 4.8}))
    screening = twice(rig, 'gravity', 'asymmetric_friction')
    chosen = chosen_of(screening)
    needless = next(number for number, one in enumerate(screening.library.candidates)
                    if one.name == 'torque_constant_error')
    pruned = Selection(screening).pruned([needless, *chosen])
    assert pruned == chosen and names_of(screening, chosen) == ['gravity']
