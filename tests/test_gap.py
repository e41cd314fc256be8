"""The diagnosis of the gap: its processing against closed forms, its verdicts against truths."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.optimize import lsq_linear
from synthetic import PERIOD, sampled

from servo_identify.gap import diagnose as diagnosing
from servo_identify.gap.balance import Balance
from servo_identify.gap.candidates import Candidate
from servo_identify.gap.checks import CannotDiagnose, unsaturated
from servo_identify.gap.diagnose import diagnose
from servo_identify.gap.observation import observe
from servo_identify.gap.regression import bounded
from servo_identify.gap.scales import orders, Scales
from servo_identify.gap.selection import Selection
from servo_identify.gap.splitting import split
from servo_identify.gap.weak_form import Bump, count_of, noise_of
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find, names
from servo_twin.physics.servo import Placed
from servo_twin.recording.recording import Recording

SERVO = servo_file.load(
    Path(__file__).resolve().parent.parent / 'config' / 'servos' / 'rv_bench.yaml')
FEW = tuple(n for n in names() if n not in ('load_dependent_friction', 'gravity', 'backlash'))
"""A small catalogue compiles in seconds; the blind check is what runs the whole one."""


def recorded(rig, seed, family='multisine', seconds=6.0):
    """Return a recording of a rig, moved by several sines."""
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    command = sum(1.1 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.5, 1.3, 3.1))
    return replace(sampled(rig, command, seed=seed), name=f'{family}_{seed}', family=family)


def three(rig):
    return [recorded(rig, seed) for seed in (1, 2, 3)]


def with_effect(name, site, **values):
    return SERVO.with_effects(Placed('e', find(name), site), values={
        f'effects.e.{key}': value for key, value in values.items()})


@given(spacing=st.integers(2, 8), frequency=st.floats(0.1, 8.0))
def test_a_derivative_under_the_bump_is_that_of_the_weighed_signal(spacing, frequency):
    bump, time = Bump(spacing, 1e-3, 1), np.arange(1500) * 1e-3
    rate = 2.0 * np.pi * frequency
    wave, slope = np.sin(rate * time), rate * np.cos(rate * time)
    assert bump.weigh(wave, 1) == pytest.approx(bump.weigh(slope), abs=1e-4 * rate)
    assert bump.weigh(wave, 2) == pytest.approx(-rate**2 * bump.weigh(wave), abs=1e-3 * rate**2)


@given(spacing=st.integers(2, 8), order=st.integers(0, 2))
def test_the_gain_of_a_bump_is_the_noise_that_passes(spacing, order):
    bump = Bump(spacing, 1e-3, 1)
    noise = np.random.default_rng(spacing).normal(size=200_000)
    assert np.std(bump.weigh(noise, order)) == pytest.approx(bump.gain(order), rel=0.05)


@given(sigma=st.floats(1e-6, 1e-2), count=st.floats(1e-5, 1e-2))
@settings(deadline=None)
def test_noise_and_counts_are_read_off_a_moving_signal(sigma, count):
    chance, time = np.random.default_rng(0), np.arange(5000) * 1e-3
    smooth = np.sin(3.0 * time)
    noisy = smooth + chance.normal(0.0, sigma, len(time))
    assert noise_of(noisy) == pytest.approx(sigma, rel=0.1)
    assert count_of(noisy) == 0.0
    rounded = np.round((smooth + chance.normal(0.0, count, len(time))) / count) * count
    assert count_of(rounded) == pytest.approx(count, rel=1e-6)


@given(st.integers(0, 10_000))
@settings(deadline=None)
def test_the_bounded_fit_agrees_with_scipy(seed):
    chance = np.random.default_rng(seed)
    size = int(chance.integers(1, 7))
    table, target = chance.normal(size=(30, size)), chance.normal(size=30)
    low, high = -chance.uniform(0.0, 0.3, size), chance.uniform(0.01, 0.3, size)
    ours = bounded(table.T @ table, table.T @ target, low, high)
    theirs = lsq_linear(table, -target, (low, high), tol=1e-12).x
    assert np.sum((target + table @ ours)**2) <= np.sum((target + table @ theirs)**2) + 1e-6


def test_the_order_of_a_periodic_residual_is_found():
    angle = np.linspace(0.0, 9.0, 4000)**1.3
    noise = np.random.default_rng(0).normal(0.0, 0.5, len(angle))
    assert orders(angle, np.cos(23.0 * angle + 1.0) + noise)[0] == 23.0


def test_an_order_may_be_found_on_a_part_of_its_turn_without_its_neighbours():
    angle = 1.2 * np.sin(np.linspace(0.0, 20.0, 4000))
    found = orders(angle, np.sin(angle + 0.4), least=0.35)
    assert found[0] == 1.0
    assert np.min(np.diff(sorted(found))) > 2.0 * np.pi / 2.4
    assert orders(angle, np.sin(angle + 0.4))[0] >= 2.0 * np.pi / 2.4


def test_the_order_of_which_the_strongest_is_a_multiple_is_found_too():
    angle = np.linspace(0.0, 7.0, 4000)
    twice = np.cos(2.0 * angle) + 0.3 * np.sin(angle)
    assert 1.0 not in orders(angle, twice)
    assert orders(angle, twice, multiples=3)[0] == 2.0 and 1.0 in orders(angle, twice, multiples=3)
    assert set(orders(angle, np.cos(12.0 * angle), most=1, multiples=3)) == {12.0, 6.0, 4.0}
    assert 1.0 not in orders(angle[angle < 5.0], twice[angle < 5.0], multiples=3)


def test_the_balances_of_a_rig_are_at_the_noise_floor_under_its_own_laws():
    seen = observe([recorded(SERVO, 1)], SERVO)[0]
    balance = Balance(SERVO, seen, len(SERVO.effects))
    residuals = balance.residuals(SERVO.theta, SERVO.switches)
    torque = np.sqrt(np.mean(seen.channels.torque**2))
    moving = balance.moving('load')
    assert np.sqrt(np.nanmean(residuals['load'][moving]**2)) < 0.02 * torque
    assert set(residuals) == {'drive', 'motor', 'load', 'transmission'}


def test_a_twin_that_lacks_nothing_has_no_gap():
    inside = SERVO.with_values({'mechanism.load_inertia': 5.4, 'drive.torque_constant': 0.475})
    first, second, third = three(inside)
    report = diagnose([first], SERVO, [second], [third], FEW).report
    assert report.verdict['status'] == 'no_gap'
    assert report.which == () and report.verdict['effects'] == []


def test_a_missing_effect_is_named_measured_and_put_into_the_servo_file():
    first, second, third = three(with_effect('load_dependent_friction', 'load', share=0.12))
    found = diagnose([first], SERVO, [second], [third], FEW)
    report, cause = found.report, found.report.which[0]
    assert report.verdict['effects'] == ['load_dependent_friction']
    assert report.verdict['balance'] == 'load'
    # one excitation tells the share from the Coulomb level only in part
    assert 0.06 < cause.parameters['share']['value'] < 0.25
    assert cause.shrink_realised > 0.5
    assert servo_file.loads(servo_file.dumps(found.augmented)) == found.augmented
    tree = report.as_dict()
    assert tree['schema'] == 'servo_gap/1'
    assert {'servo', 'recordings', 'channels', 'where', 'which', 'verdict', 'gap', 'unknown',
            'next_experiment', 'warnings'} <= set(tree)


def test_a_missing_effect_that_the_catalogue_lacks_is_called_unknown():
    rig = with_effect('stribeck_friction', 'load', excess=9.0, fade=0.1)
    first, second, third = three(rig)
    report = diagnose([first], SERVO, [second], [third], FEW).report
    assert report.verdict['status'] in ('unknown', 'partly_explained')


def test_a_torque_that_reads_wrong_is_not_taken_for_two_causes_at_either_side_of_it():
    rig = with_effect('torque_sensor_gain', 'torque', excess=0.12)
    first, second, third = three(rig)
    report = diagnose([first], SERVO, [second], [third], FEW).report
    assert report.verdict['status'] == 'unknown' and report.which == ()
    assert 'reading of the torque is wrong' in report.verdict['sentence']


def test_a_torque_that_reads_wrong_is_named_where_the_catalogue_has_it():
    rig = with_effect('torque_sensor_gain', 'torque', excess=0.12)
    first, second, third = three(rig)
    few = tuple(name for name in FEW if name != 'torque_sensor_gain')
    report = diagnose([first], SERVO, [second], [third], few).report
    assert report.verdict['effects'] == ['torque_sensor_gain']


def test_laws_of_one_kind_act_on_the_same_variables_at_the_same_place():
    kind = {(name, site): Candidate(name, site, (), (), effect=find(name)).kind
            for name, site in (('gravity', 'load'), ('spring_load', 'load'), ('cogging', 'motor'),
                               ('friction_drift', 'load'), ('load_dependent_friction', 'load'))}
    assert kind['gravity', 'load'] == kind['spring_load', 'load'] != kind['cogging', 'motor']
    assert kind['friction_drift', 'load'] != kind['load_dependent_friction', 'load']
    assert find('load_dependent_friction').variables() == {'torque', 'direction'}
    assert Candidate('parameter:stiffness', '', (), ()).kind is None


def test_laws_of_one_order_at_one_place_can_take_each_others_shape():
    def law(name, site, order):
        path = f'effects.{name}__{site}.order'
        return Candidate(name, site, (), (), ((path, order),), effect=find(name))

    error = law('transmission_error', 'mesh', 40.0)
    assert law('position_dependent_backlash', 'mesh', 40.0).takes_shape_of(error)
    assert not law('position_dependent_backlash', 'mesh', 20.0).takes_shape_of(error)
    assert not law('cogging', 'motor', 40.0).takes_shape_of(error)
    # a weight has the order of the turn by its nature
    weight = law('gravity', 'load', 1.0)
    assert not law('position_dependent_friction', 'load', 1.0).takes_shape_of(weight)


def test_bristles_are_tried_from_a_part_of_the_shortest_to_one_of_the_longest_way():
    ways = [np.array([0.0, way]) for way in (400.0, 20.0, 0.01)]  # the last one does not move
    scales = Scales([SimpleNamespace(motion=lambda name, way=way: way) for way in ways])
    tried = [shapes['breakaway'] for shapes in scales.grid(find('presliding_friction'), 'motor')]
    assert tried[0] == pytest.approx(0.002 * 20.0) and tried[-1] == 10.0  # no bristle is longer
    assert np.all(np.diff(np.log(tried)) <= np.log(5.0) + 1e-9)
    still = Scales([SimpleNamespace(motion=lambda name: np.zeros(2))])
    assert [shapes['breakaway'] for shapes in still.grid(
        find('presliding_friction'), 'motor')] == [1e-4, 1e-3, 1e-2]


@pytest.mark.parametrize(('gain', 'kept'), ((14.0, [0]), (16.0, [0, 1])))
def test_a_law_that_only_mends_the_shape_of_another_is_no_cause(gain, kept):
    spring, weight = (Candidate(n, 'load', (), (), effect=find(n))
                      for n in ('spring_load', 'gravity'))
    left = {(): 120.0, (1,): 101.0, (0,): 1.0 + gain, (0, 1): 1.0}
    screening = SimpleNamespace(library=SimpleNamespace(candidates=[spring, weight]),
                                loss=lambda chosen: left[tuple(chosen)])
    assert Selection(screening)._of_their_own([0, 1]) == kept


@pytest.mark.parametrize(('gap', 'stays'), ((0.5, True), (90.0, True), (9000.0, False)))
def test_a_twin_that_is_a_hundred_times_worse_on_other_recordings_has_run_away(
        monkeypatch, gap, stays):
    told = SimpleNamespace(gap=SimpleNamespace(total=lambda reference: gap))
    monkeypatch.setattr(diagnosing, 'tried', lambda *asked: told)
    bare = SimpleNamespace(total=lambda reference: 1.0)
    assert diagnosing._runs(None, [0], [], bare) is stays


def test_what_cannot_be_judged_is_said():
    good = recorded(SERVO, 1)
    with pytest.raises(CannotDiagnose, match='different machines'):
        diagnose([replace(good, servo='a'), replace(good, servo='b')], SERVO)
    with pytest.raises(CannotDiagnose, match='at least 3 s'):
        diagnose([recorded(SERVO, 1, seconds=1.0)], SERVO)
    still = {n: np.zeros(5000) for n in ('voltage', 'motor_position', 'load_position', 'current')}
    with pytest.raises(CannotDiagnose, match='nothing moves'):
        diagnose([Recording('still', 1e-3, still)], SERVO)
    blind = {n: np.full(5000, np.nan) for n in ('motor_position', 'load_position')}
    with pytest.raises(CannotDiagnose, match='neither motor_position nor load_position'):
        diagnose([Recording('blind', 1e-3, {**blind, 'voltage': np.ones(5000)})], SERVO)


def test_a_recording_at_its_limit_throughout_is_left_out_or_refused_alone():
    good, limit = recorded(SERVO, 1), SERVO.values['controller.limit']
    pinned = replace(good, name='pinned', columns={
        **good.columns, 'voltage': np.full(len(good), limit)})
    kept, said = unsaturated([good, pinned], SERVO)
    assert kept == [good]
    assert 'pinned' in said[0] and f'{limit:g} V' in said[0]
    with pytest.raises(CannotDiagnose, match='pinned: the command is at its limit'):
        unsaturated([pinned], SERVO)


def test_recordings_are_split_by_recording():
    made = [replace(recorded(SERVO, 1, seconds=1.0), name=f'{family}{n}', family=family)
            for family in ('a', 'b') for n in range(3)]
    parts = split(made, [], [])
    assert [len(p) for p in (parts.screen, parts.accept, parts.report)] == [2, 2, 2]
    names_of = [{r.name for r in p} for p in (parts.screen, parts.accept, parts.report)]
    assert not names_of[0] & names_of[1] and not names_of[1] & names_of[2]
    assert len(split(made[:1], [], []).warnings) == 1


def test_recordings_of_one_name_and_no_family_are_split_all_the_same():
    made = [replace(recorded(SERVO, n, seconds=1.0), name='bag', family='') for n in range(4)]
    parts = split(made, [], [])
    assert [len(p) for p in (parts.screen, parts.accept, parts.report)] == [2, 1, 1]
    assert len({id(r) for p in (parts.screen, parts.accept, parts.report) for r in p}) == 4
