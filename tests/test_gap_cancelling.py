"""Two causes that undo each other stand in for a third, and are not there themselves."""

from types import SimpleNamespace

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
from screened import chosen_of, names_of, twice, with_effects

from servo_identify.gap.balance import BALANCES
from servo_identify.gap.cancelling import cancelling

ROWS = 60


def fitted(*done):
    """Return a screening in which each cause does to the load balance what is given."""
    tables = [np.asarray(one)[:, None] for one in done]
    return SimpleNamespace(
        stack=SimpleNamespace(balance=np.full(ROWS, BALANCES.index('load'))),
        members=[np.array([number]) for number in range(len(done))], table=tables.__getitem__,
        coefficients=lambda chosen: (np.array(chosen), np.ones(len(chosen))))


@given(st.integers(0, 10_000), st.floats(2.0, 50.0), st.floats(0.6, 1.0))
@settings(deadline=None)
def test_opposite_causes_of_like_size_undo_each_other(seed, size, share):
    chance = np.random.default_rng(seed)
    one, noise = chance.normal(size=ROWS), 0.1 * chance.normal(size=ROWS)
    one *= size / np.sqrt(np.mean(one**2))
    assert cancelling(fitted(one, noise - share * one), [0, 1]) == [(0, 1, 'load')]
    assert cancelling(fitted(one, noise + share * one), [0, 1]) == []


def test_what_is_much_smaller_or_within_the_noise_undoes_nothing():
    one = np.sin(np.arange(ROWS))
    assert cancelling(fitted(20.0 * one, -5.0 * one), [0, 1]) == []
    assert cancelling(fitted(0.5 * one, -0.5 * one), [0, 1]) == []


def test_two_true_causes_stand():
    """Also where the two oppose each other on a part of the way."""
    rig = with_effects(('gravity', 'load', {'sine': 12.0, 'cosine': -4.8}),
                       ('asymmetric_friction', 'load', {'difference': 30.0, 'slope': 0.0}))
    screening = twice(rig, 'gravity', 'spring_load', 'asymmetric_friction')
    chosen = chosen_of(screening)
    assert set(names_of(screening, chosen)) == {'gravity', 'asymmetric_friction'}
    assert cancelling(screening, chosen) == []
