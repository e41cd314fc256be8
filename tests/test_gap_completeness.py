"""What is left of a balance: what replicates share of it, and the variables it is looked at by."""

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from screened import BENCH, extended, stacked
from synthetic import PERIOD, sampled

from servo_identify.gap.completeness import repeatable, since_reversal
from servo_identify.gap.status import squares_of


def swept(family, seconds, hertz, seed):
    """Return a recording of the bench under a sine."""
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    recording = sampled(BENCH, 1.6 * np.sin(2.0 * np.pi * hertz * time), seed=seed)
    return replace(recording, name=f'{family} {seed}', family=family)


@pytest.fixture(scope='module')
def stacks():
    """Return the residuals of two families, one four times as long as the other, made twice."""
    bench = extended(BENCH)
    return [stacked([swept('sine', 12.0, 0.5, seed), swept('chirp', 3.0, 2.0, seed + 10)], bench)
            for seed in (1, 2)]


def test_what_is_there_each_time_counts_as_much_as_in_the_mean_squares(stacks):
    first, second = stacks
    there = np.where(first.recording == 1, 30.0, 1.0)  # most of it in the short family
    again = np.where(second.recording == 1, 30.0, 1.0)
    common, squares = repeatable(first, there, second, again), squares_of(first, there)
    for balance, square in squares.items():
        assert common[balance] == pytest.approx(square, rel=0.02)


def test_noise_has_nothing_in_common(stacks):
    first, second = stacks
    chance = np.random.default_rng(3)
    noise = [chance.normal(size=len(one.base)) for one in stacks]
    assert max(repeatable(first, noise[0], second, noise[1]).values()) < 0.1


@given(st.lists(st.sampled_from((-1.0, -0.5, 0.0, 0.5, 1.0)), min_size=1, max_size=60))
def test_the_travel_begins_anew_where_the_way_turns_and_not_at_rest(speeds):
    speed = np.array(speeds)
    angle = np.concatenate(([0.0], np.cumsum(speed)[:-1]))
    expected, way, anchor = [], 0.0, 0.0
    for now, place in zip(speed, angle, strict=True):
        if now * way < 0.0:
            anchor = place
        way = np.sign(now) or way
        expected.append(abs(place - anchor))
    np.testing.assert_allclose(since_reversal(angle, speed), expected, atol=1e-12)
