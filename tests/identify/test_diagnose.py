"""The diagnosis of the gap: its processing against closed forms, its answers against truths."""

from dataclasses import replace
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.optimize import lsq_linear
from synthetic_recordings import PERIOD, sampled

from servo_identify.data.encoder_count import count_of
from servo_identify.diagnose.answer.patch import patched
from servo_identify.diagnose.checks import CannotDiagnose, usable
from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.mechanisms.orders import strongest
from servo_identify.diagnose.residuals.noise import noise_of
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.residuals.test_function import TestFunction
from servo_identify.diagnose.selection.bounded_least_squares import bounded
from servo_identify.diagnose.splitting import split
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.recording.recording import Recording

FILE = Path(__file__).resolve().parents[2] / 'config' / 'servos' / 'rv_bench.yaml'
SERVO = servo_file.load(FILE)


def recorded(rig, seed, family='multisine', seconds=6.0):
    """Return a recording of a rig, moved by several sines."""
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    command = sum(1.1 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.5, 1.3, 3.1))
    return replace(sampled(rig, command, seed=seed), name=f'{family}_{seed}', family=family)


def three(rig):
    return [recorded(rig, seed) for seed in (1, 2, 3)]


def answered(rig, servo=SERVO, **more):
    """Return the diagnosis of three recordings of a rig, one for each purpose."""
    first, second, third = three(rig)
    return diagnose([first], servo, [second], [third], **more)


def with_effect(name, site, **values):
    return SERVO.with_effects(Placed('e', find(name), site), values={
        f'effects.e.{key}': value for key, value in values.items()})


@given(spacing=st.integers(2, 8), frequency=st.floats(0.1, 8.0))
def test_a_derivative_under_a_test_function_is_that_of_the_projected_signal(spacing, frequency):
    test, time = TestFunction(spacing, 1e-3, 1), np.arange(1500) * 1e-3
    rate = 2.0 * np.pi * frequency
    wave, slope = np.sin(rate * time), rate * np.cos(rate * time)
    assert test.project(wave, 1) == pytest.approx(test.project(slope), abs=1e-4 * rate)
    assert test.project(wave, 2) == pytest.approx(-rate**2 * test.project(wave),
                                                  abs=1e-3 * rate**2)


@given(spacing=st.integers(2, 8), order=st.integers(0, 2))
def test_the_gain_of_a_test_function_is_the_noise_that_passes(spacing, order):
    test = TestFunction(spacing, 1e-3, 1)
    noise = np.random.default_rng(spacing).normal(size=200_000)
    assert np.std(test.project(noise, order)) == pytest.approx(test.gain(order), rel=0.05)


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


def test_a_column_of_which_a_difference_of_sums_leaves_rounding_alone_moves_nothing():
    table = np.random.default_rng(0).normal(size=(30, 3))
    gram, slope = np.zeros((4, 4)), np.zeros(4)
    gram[:3, :3], slope[:3] = table.T @ table, table.T @ np.ones(30)
    gram[3, :3] = gram[:3, 3] = 1e-15
    gram[3, 3], slope[3] = -1e-18, 1e-16
    wide = np.full(4, 10.0)
    found = bounded(gram, slope, -wide, wide)
    assert found[:3] == pytest.approx(bounded(gram[:3, :3], slope[:3], -wide[:3], wide[:3]))
    assert np.isfinite(found).all()


def test_the_order_of_a_periodic_residual_is_found():
    angle = np.linspace(0.0, 9.0, 4000)**1.3
    noise = np.random.default_rng(0).normal(0.0, 0.5, len(angle))
    found, tried = strongest(angle, np.cos(23.0 * angle + 1.0) + noise, np.ones(len(angle)), 1.0)
    assert found[0] == 23.0 and tried > 100


def test_the_equations_of_a_rig_are_at_the_noise_floor_under_its_own_models():
    samples = residual_samples([recorded(SERVO, 1)], SERVO)
    assert set(samples.present) == {'drive', 'motor', 'load', 'transmission'}
    for equation in samples.present:
        assert np.sqrt(np.mean(samples.base[samples.rows(equation)]**2)) < 1.3, equation


@pytest.mark.slow
def test_a_twin_that_matches_its_rig_within_tolerance_has_no_gap_and_comes_back_to_the_noise():
    inside = SERVO.with_values({'mechanism.load_inertia': 5.6, 'drive.torque_constant': 0.478})
    found = answered(inside)
    report = found.report
    assert report.verdict['status'] == 'no_gap'
    assert report.which == () and report.verdict['effects'] == []
    assert report.gap['within_tolerance'] < 2.0 * report.gap['floor']
    assert patched(FILE.read_text(), SERVO, found.augmented) == FILE.read_text()


@pytest.mark.slow
def test_one_recording_that_contradicts_the_file_is_left_out_and_the_others_are_diagnosed():
    several = [recorded(SERVO, seed) for seed in (1, 2, 3, 4)]
    columns = {**several[-1].columns, 'voltage': -several[-1].columns['voltage']}
    several[-1] = replace(several[-1], name='turned', columns=columns)
    report = diagnose(several, SERVO).report
    assert report.verdict['status'] == 'no_gap'
    assert any('turned is left out' in one for one in report.warnings)
    assert 'turned' not in sum(report.recordings.values(), [])


@pytest.fixture(scope='module')
def loaded_friction():
    return answered(with_effect('load_dependent_friction', 'load', share=0.12))


@pytest.mark.long
@pytest.mark.slow
def test_a_missing_effect_is_named_measured_and_located(loaded_friction):
    report, one = loaded_friction.report, loaded_friction.report.which[0]
    assert report.verdict['effects'] == ['load_dependent_friction']
    assert report.verdict['balance'] == 'load' and report.verdict['status'] == 'explained'
    assert one.rung == 'law' and one.law
    # one excitation tells the share from the Coulomb level only in part
    assert 0.06 < one.parameters['share']['value'] < 0.25
    assert one.shrink_realised > 0.8 and report.gap['solved'] > 0.8


@pytest.mark.slow
def test_its_report_has_all_fields_of_the_schema(loaded_friction):
    tree = loaded_friction.report.as_dict()
    assert tree['schema'] == 'servo_gap/2'
    assert {'servo', 'recordings', 'channels', 'where', 'which', 'verdict', 'gap', 'unknown',
            'next_experiment', 'warnings', 'moved', 'defaults', 'stability'} <= set(tree)
    one = tree['which'][0]
    assert {'effect', 'site', 'parameters', 'shrink_predicted', 'shrink_realised', 'interval',
            'ambiguous_with', 'rung', 'confidence', 'mechanism', 'law', 'curve',
            'alternatives'} <= set(one)
    assert set(one['confidence']) == {'place', 'mechanism', 'curve', 'law'}
    rungs = [one['confidence'][name] for name in ('mechanism', 'curve', 'law')]
    assert rungs == sorted(rungs, reverse=True)
    assert set(one['mechanism']) == {'port', 'site', 'variables', 'symmetry', 'memory',
                                         'driving'}
    curve = one['curve']
    assert curve['variable'] == 'load' and curve['unit'] == 'N m'
    assert all(low <= y <= high for low, y, high in zip(
        curve['low'], curve['y'], curve['high'], strict=True))
    assert {'as_given', 'within_tolerance', 'solved', 'before', 'after', 'floor', 'shrink',
            'interval'} <= set(tree['gap'])
    assert {'as_given', 'augmented', 'rms_gap', 'noise_floor'} <= set(tree['channels']['torque'])
    assert tree['stability']['splits'] == 4
    assert tree['stability']['named_in']['load_dependent_friction'] >= 0.5


@pytest.mark.slow
def test_its_augmented_file_is_the_given_one_with_the_effect_and_nothing_else(loaded_friction):
    before = FILE.read_text()
    after = patched(before, SERVO, loaded_friction.augmented)
    old, new = before.splitlines(), after.splitlines()
    added = [line for line in new if line not in old]
    assert len(added) == 1 and 'load_dependent_friction' in added[0]
    assert [line for line in old if line not in new] == []
    assert servo_file.loads(after).values['effects.load_dependent_friction.share'] == (
        pytest.approx(loaded_friction.augmented.values['effects.load_dependent_friction.share'],
                      rel=1e-5))


@pytest.mark.slow
def test_the_augmented_twin_has_no_gap_of_its_own(loaded_friction):
    again = answered(with_effect('load_dependent_friction', 'load', share=0.12),
                     loaded_friction.augmented)
    assert again.report.verdict['status'] == 'no_gap'


@pytest.mark.long
@pytest.mark.slow
def test_a_friction_of_no_formula_is_named_by_its_mechanism_and_handed_over_as_a_curve():
    """A level that rises, stays and rises again with the load: no law of the catalogue."""
    rig = with_effect('friction_over_load', 'load', low=0.0, high=120.0,
                      curve=(0.0, 0.0, 6.0, 6.5, 6.5, 7.0, 14.0, 15.0))
    found = answered(rig)
    report = found.report
    assert 'load_dependent_friction' in [name for one in report.which
                                         for name in (one.effect, *one.ambiguous_with)]
    assert report.gap['solved'] > 0.5


@pytest.mark.long
@pytest.mark.slow
def test_a_missing_effect_that_is_left_out_is_called_unknown_with_its_variable():
    rig = with_effect('stribeck_friction', 'load', excess=9.0, fade=0.1)
    without = ('stribeck_friction', 'coulomb_friction', 'viscous_friction', 'quadratic_drag',
               'presliding_friction', 'friction_over_speed')
    report = answered(rig, without=without).report
    assert report.verdict['status'] in ('unknown', 'partly_explained')
    assert report.unknown['depends_on'][0] in ('speed', 'travel since reversal')
    assert report.verdict['balance'] == 'load'


@pytest.mark.long
@pytest.mark.slow
def test_a_torque_that_reads_wrong_is_named_as_the_reading():
    report = answered(with_effect('torque_sensor_gain', 'torque', excess=0.12)).report
    assert report.verdict['effects'] == ['torque_sensor_gain']


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('silent', [(), ('current',)])
def test_the_only_encoder_that_is_late_is_named_or_stands_beside_a_late_command(silent):
    rig = with_effect('sensor_delay', 'motor_position', delay=4e-3)
    gone = ('load_position', 'torque', *silent)
    one, two, three_ = (replace(each, columns={
        **each.columns, **{name: np.full(len(each), np.nan) for name in gone}})
        for each in three(rig))
    which = diagnose([one], SERVO, [two], [three_]).report.which
    told = {which[0].effect, *which[0].ambiguous_with}
    if silent:  # what the drive does late of its command looks the same
        assert told >= {'sensor_delay', 'command_delay'}
        return
    assert which[0].effect == 'sensor_delay' and which[0].site == 'motor_position'
    assert 'command_delay' not in told
    assert which[0].parameters['delay']['value'] == pytest.approx(4e-3, rel=0.3)


@pytest.mark.long
@pytest.mark.slow
def test_one_more_order_of_what_the_file_has_is_found():
    known = SERVO.with_effects(Placed('te', find('transmission_error'), 'mesh'), values={
        'effects.te.order': 40.0, 'effects.te.cosine': (6e-5,)})
    rig = known.with_effects(Placed('te2', find('transmission_error'), 'mesh'), values={
        'effects.te2.order': 13.0, 'effects.te2.cosine': (2e-4,)})
    report = answered(rig, known).report
    assert report.verdict['effects'] == ['transmission_error']
    assert report.which[0].parameters['order' if 'order' in report.which[0].parameters
                                      else 'cosine[0]']['value'] != 0.0


@pytest.mark.slow
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


def test_a_recording_that_cannot_be_judged_is_left_out_or_refused_alone():
    good, limit = recorded(SERVO, 1), SERVO.values['controller.limit']
    pinned = replace(good, name='pinned', columns={
        **good.columns, 'voltage': np.full(len(good), limit)})
    short = replace(good, name='short', columns={n: c[:500] for n, c in good.columns.items()})
    kept, said = usable([good, pinned, short], SERVO)
    assert kept == [good]
    assert 'pinned' in said[0] and f'{limit:g} V' in said[0]
    assert 'short' in said[1] and 'at least 3 s' in said[1]
    with pytest.raises(CannotDiagnose, match='pinned: the command is at its limit'):
        usable([pinned], SERVO)


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
