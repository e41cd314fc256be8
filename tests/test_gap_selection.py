"""Which causes the recordings ask for, where one by one is not enough."""

from screened import chosen_of, names_of, twice, with_effects

from servo_identify.gap.selection import Selection


def test_two_causes_are_found_behind_a_third_that_does_a_part_of_both():
    rig = with_effects(('gravity', 'load', {'sine': 12.0, 'cosine': 4.8}),
                       ('asymmetric_friction', 'load', {'difference': 30.0, 'slope': 0.0}))
    screening = twice(rig, 'asymmetric_friction', 'gravity', 'spring_load',
                      'load_dependent_friction')
    one_by_one = Selection(screening)._grown([], lambda share: None)
    assert names_of(screening, one_by_one) == ['spring_load']
    assert set(names_of(screening, chosen_of(screening))) == {'asymmetric_friction', 'gravity'}
