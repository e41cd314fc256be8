"""A torque from outside that repeats in time, and motions that repeat in time themselves."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from synthetic_recordings import PERIOD, sampled
from test_selection import SERVO, with_effect

from servo_identify.diagnose.answer.left_over import correlation_time
from servo_identify.diagnose.diagnose import diagnose

PERIOD_OUTSIDE, SIZE = 0.2326, 25.0  # s, N m


def wind(samples, seed, size, forgets):
    """Return gusts (samples,) of that size, N m, which forget themselves within some s."""
    keeps = np.exp(-PERIOD / forgets)
    noise = np.random.default_rng(seed).normal(0.0, size * np.sqrt(1.0 - keeps**2), samples)
    return lfilter([1.0], [1.0, -keeps], noise)


def shaken(seed, servo=SERVO, size=SIZE, told=False, seconds=6.0, gusts=0.0):
    """
    Return a recording of an axis whose load a machine beside it shakes.

    Or wind, where ``gusts`` says how long a gust lasts, s.
    """
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    command = sum(1.1 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.5, 1.3, 3.1))
    outside = size * np.sin(2.0 * np.pi * time / PERIOD_OUTSIDE + 2.0 * seed)
    if gusts:
        outside = wind(len(time), seed, size, gusts)
    one = sampled(servo, command, seed=seed, external=outside)
    columns = one.columns if told else one.columns | {
        'external_torque': np.full(len(time), np.nan)}
    return replace(one, name=f'multisine_{seed}', family='multisine', columns=columns)


def answer_of(servo=SERVO, **how):
    first, second, third = (shaken(seed, servo, **how) for seed in (1, 2, 3))
    return diagnose([first], SERVO, [second], [third]).report


@pytest.mark.long
@pytest.mark.slow
def test_a_torque_that_repeats_in_time_is_named_with_its_period_and_no_effect_is_handed_over():
    report = answer_of()
    assert [(one.effect, one.site) for one in report.which] == [('external_torque', 'load')]
    assert f'every {PERIOD_OUTSIDE:.4g} s' in report.which[0].change
    assert float(report.which[0].change.split()[0]) == pytest.approx(SIZE, rel=0.05)
    assert 'column external_torque' in report.verdict['sentence']
    assert report.gap['after'] == report.gap['before']
    assert report.which[0].shrink_realised > 0.9  # of its equation
    assert not report.which[0].simulated


@pytest.mark.long
@pytest.mark.slow
def test_of_wind_it_says_how_strong_it_is_and_how_long_a_gust_lasts():
    report = answer_of(gusts=0.4, seconds=20.0)
    rest = report.verdict['left_over']['load']
    assert rest['rms'] == pytest.approx(SIZE, rel=0.2)
    assert rest['seconds'] == pytest.approx(0.4, rel=0.4)
    assert 'A torque from outside does that, as wind or a hand' in report.verdict['sentence']


def test_the_time_constant_of_gusts_is_told_though_rows_are_missing():
    several = [wind(200_000, seed, 1.0, 0.05) for seed in (1, 2)]
    for one in several:
        one[::7] = np.nan
    assert correlation_time([(one, PERIOD) for one in several]) == pytest.approx(0.05, rel=0.1)


@pytest.mark.long
@pytest.mark.slow
def test_beside_it_another_effect_is_found():
    rubs = with_effect('coulomb_friction', 'motor', level=0.1)
    assert {one.effect for one in answer_of(rubs).which} == {'coulomb_friction', 'external_torque'}


@pytest.mark.long
@pytest.mark.slow
def test_one_that_is_measured_is_no_gap():
    assert answer_of(told=True).verdict['status'] == 'no_gap'


@pytest.mark.long
@pytest.mark.parametrize('rig', [
    with_effect('coulomb_friction', 'motor', level=0.1),
    with_effect('gravity', 'load', cosine=20.0, sine=10.0),
    SERVO.with_values({'mechanism.load_inertia': 1.2 * SERVO.numbers['mechanism.load_inertia']}),
], ids=['friction', 'gravity', 'inertia'])
def test_what_a_motion_makes_that_repeats_is_no_torque_from_outside(rig):
    time = np.arange(6000) * PERIOD

    def recorded(seed):
        one = sampled(rig, 3.0 * np.sin(2.0 * np.pi * 1.5 * time + seed), seed=seed)
        return replace(one, name=f'sine_{seed}', family='sine')

    first, second, third = map(recorded, (1, 2, 3))
    named = {one.effect for one in diagnose([first], SERVO, [second], [third]).report.which}
    assert named and 'external_torque' not in named
