"""What the equations alone say is missing: effects beside others, and where each acts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_recordings import PERIOD, sampled

from servo_identify.diagnose.answer.row_instants import (
    as_acted,
    command_late,
    split_as_acted,
    told_late,
)
from servo_identify.diagnose.decisions import CALIBRATED
from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.mechanisms.hypothesis import Mechanism
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.confidence import preferred, Rival, surer
from servo_identify.diagnose.selection.explain import explained
from servo_identify.diagnose.selection.regression import Products
from servo_identify.diagnose.selection.stability import instead, share_in_place, share_of
from servo_identify.diagnose.splitting import Split
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.recording.recording import Recording

FILE = Path(__file__).resolve().parents[2] / 'config' / 'servos' / 'rv_bench.yaml'
SERVO = servo_file.load(FILE)


def recorded(rig, seed, seconds=5.0):
    """Return a recording of a rig, moved by several sines."""
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    command = sum(1.1 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.5, 1.3, 3.1))
    return replace(sampled(rig, command, seed=seed), name=f'multisine_{seed}', family='multisine')


def diagnosed(rig):
    """Return the diagnosis of three recordings of a rig, one for each purpose."""
    first, second, third = (recorded(rig, seed) for seed in (1, 2, 3))
    return diagnose([first], SERVO, [second], [third])


def answered(rig):
    return diagnosed(rig).report


def with_effect(name, site, **values):
    return SERVO.with_effects(Placed('e', find(name), site), values={
        f'effects.e.{key}': value for key, value in values.items()})


def named_by_equations(recordings, servo=SERVO):
    """Return (name, site) of what the equations alone say is missing."""
    found = explained(residual_samples(recordings, servo))
    return {(one.mechanism.name, one.mechanism.site) for one in found.chosen}


def test_what_may_act_at_either_shaft_is_one_cause_against_another():
    def rival(name, site, confidence):
        return Rival(0, 0, Mechanism(name, 'friction', site, ('direction',), 'none'), confidence)

    motor, load = (rival('asymmetric_friction', site, share) for site, share in (
        ('motor', 0.31), ('load', 0.3)))
    assert surer('constant_torque', 0.35, [motor, load]) is motor
    assert surer('constant_torque', 0.65, [motor, load]) is None
    assert surer('asymmetric_friction', 0.2, [motor, load]) is motor  # at the surer place
    assert surer('asymmetric_friction', 0.4, [rival('constant_torque', 'load', 0.5), load]) is None


def test_no_sum_of_squares_is_negative():
    """A column that is the residual leaves nothing, and rounding no less than that."""
    table = np.random.default_rng(0).normal(size=(40, 50, 2))
    table = np.dstack((table @ (0.3, 0.7), table))  # the residual is a sum of its columns
    blocks = np.arange(len(table))
    products = Products([(np.arange(3), np.swapaxes(table, 1, 2) @ table)], blocks, blocks, 3)
    errors = products.errors(np.array([1.0, -0.3, -0.7]))
    assert errors.max() < 1e-10 and np.all(errors >= 0.0)


def test_a_half_counts_that_names_the_mechanism_or_what_is_not_told_from_it():
    one, other, third = (Mechanism(name, 'friction', 'load', ('direction',), 'odd')
                         for name in ('coulomb_friction', 'constant_torque', 'spring_load'))
    answers = [{each.key: each for each in some}
               for some in ((one,), (other, third), (third,), ())]
    assert share_of(answers, one) == 0.25
    assert share_of(answers, one, other) == 0.5
    assert share_of([], one) == 1.0
    assert instead(answers, [one], []) == [(third, 0.5), (other, 0.25)]
    assert instead(answers, [one], [third]) == [(other, 0.25)]


def without(recording, *names):
    gone = np.full(len(recording), np.nan)
    return replace(recording, columns={**recording.columns, **dict.fromkeys(names, gone)})


MOTOR_RUBS = with_effect('stribeck_friction', 'motor', excess=0.05, fade=8.0)
WAVES = with_effect('kinematic_error', 'mesh', order=2.0, cosine=(4e-5,), sine=(2e-5,))


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(('rig', 'blind', 'truth'), [
    (MOTOR_RUBS, ('torque',), {('stribeck_friction', 'motor')}),
    (WAVES, (), {('transmission_error', 'mesh')}),
    (with_effect('command_delay', 'command', delay=0.015), (), {('command_delay', 'command')}),
])
def test_what_acts_is_named_where_it_acts(rig, blind, truth):
    several = [without(recorded(rig, seed), *blind) for seed in (1, 2)]
    assert named_by_equations(several) == truth


@pytest.mark.long
@pytest.mark.slow
def test_friction_is_the_motors_though_a_stiff_transmission_twists_little():
    stiff = SERVO.with_values({'mechanism.stiffness': 3.0 * SERVO.numbers['mechanism.stiffness']})
    rubs = with_effect('stribeck_friction', 'motor', excess=0.2, fade=8.0)
    rig = replace(rubs, values={**rubs.values, 'mechanism.stiffness': stiff.values[
        'mechanism.stiffness']})
    several = [without(recorded(rig, seed), 'torque') for seed in (1, 2)]
    named = named_by_equations(several, stiff)
    assert [one for one in named if one[0] == 'stribeck_friction'] == [
        ('stribeck_friction', 'motor')]


@pytest.mark.long
def test_an_offset_that_drifts_is_the_sensors():
    several = []
    for seed in (1, 2):
        one = recorded(SERVO, seed)
        ramp = 0.3 * np.linspace(0.0, 1.0, len(one))
        several.append(replace(one, columns={**one.columns,
                                             'current': one.columns['current'] + ramp}))
    assert named_by_equations(several) == {('current_sensor_offset', 'current')}


@pytest.mark.slow
def test_a_gain_that_one_sign_has_alone_is_the_sensors():
    several = []
    for seed in (1, 2):
        one = recorded(SERVO, seed)
        read = one.columns['current'] * np.where(one.columns['current'] > 0.0, 1.25, 1.0)
        several.append(replace(one, columns={**one.columns, 'current': read}))
    assert named_by_equations(several) == {('current_sensor_gain', 'current')}


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(('channel', 'name'), [
    ('current', 'current_sensor_gain'), ('torque', 'torque_sensor_gain')])
def test_a_gain_that_creeps_is_the_sensors(channel, name):
    several = []
    for seed in (1, 2):
        one = recorded(SERVO, seed)
        read = one.columns[channel] * np.linspace(1.0, 1.3, len(one))
        several.append(replace(one, columns={**one.columns, channel: read}))
    assert named_by_equations(several) == {(name, channel)}


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('times', [
    lambda u: np.where(u > 0.0, 1.2, 1.0), lambda u: np.linspace(1.0, 0.8, len(u))])
def test_a_gain_of_the_drive_may_differ_by_sign_or_fade(times):
    several = []
    for seed in (1, 2):
        one = recorded(SERVO, seed)  # what was asked for, where the drive answers with more
        asked = one.columns['voltage'] / times(one.columns['voltage'])
        several.append(replace(one, columns={**one.columns, 'voltage': asked}))
    assert named_by_equations(several) == {('parameter:gain', 'drive')}


@pytest.mark.long
def test_a_gain_that_differs_by_sign_comes_with_its_effect():
    rig = with_effect('drive_asymmetry', 'command', difference_by_sign=0.2)
    first, second, third = (recorded(rig, seed) for seed in (1, 2, 3))
    answer = diagnose([first], SERVO, [second], [third])
    assert [(one.effect, one.site) for one in answer.report.which] == [('parameter:gain', 'drive')]
    numbers = answer.augmented.numbers
    assert numbers['effects.drive_asymmetry.difference_by_sign'] == pytest.approx(0.2, rel=0.05)
    assert answer.report.gap['solved'] > 0.9


@pytest.mark.long
@pytest.mark.parametrize('rig', [
    SERVO.with_values({'mechanism.stiffness': 3.0 * SERVO.numbers['mechanism.stiffness']}),
    with_effect('stiffness_ripple', 'mesh', order=20.0, cosine=(2e4,), sine=(1e4,))])
def test_a_stiffness_that_is_another_or_varies_is_no_hysteresis(rig):
    several = [recorded(rig, seed) for seed in (1, 2)]
    found, rivals = preferred(explained(residual_samples(several, SERVO)))
    assert {found.hypotheses[number].mechanism.name for number in rivals} == {'stiffness_error'}


@pytest.mark.long
@pytest.mark.slow
def test_a_small_effect_in_one_equation_is_found_beside_a_large_one_in_another():
    rig = with_effect('command_delay', 'command', delay=0.015).with_values(
        {'mechanism.load_inertia': 1.3 * SERVO.numbers['mechanism.load_inertia']})
    assert named_by_equations([recorded(rig, seed) for seed in (1, 2)]) == {
        ('command_delay', 'command'), ('parameter:load_inertia', 'load')}


@pytest.mark.long
def test_a_command_that_acts_late_by_less_than_loggers_do_is_told_and_not_named():
    rig = with_effect('command_delay', 'command', delay=0.9 * PERIOD)
    found = explained(residual_samples([recorded(rig, seed) for seed in (1, 2)], SERVO))
    assert not found.chosen
    told = told_late(found)
    assert float(told.split('acts ')[1].split()[0]) == pytest.approx(0.9, abs=0.4)
    on_time = explained(residual_samples([recorded(SERVO, seed) for seed in (1, 2)], SERVO))
    assert told_late(on_time) == ''
    assert command_late(on_time) == 0.0


@pytest.mark.slow
def test_a_command_that_acts_late_is_simulated_when_it_acts():
    rig = with_effect('command_delay', 'command', delay=0.9 * PERIOD)
    gap = answered(rig).gap
    assert gap['within_tolerance'] < 1.5 * gap['floor']


def test_a_command_stands_where_it_acts():
    one = Recording('steps', 1e-3, {'voltage': np.array([0.0, 0.0, 4.0, 4.0, 1.0, 1.0])})
    assert as_acted(one, 0.0) is one
    assert as_acted(one, 1.25).columns['voltage'] == pytest.approx([0.0, 0.0, 0.0, 3.0, 4.0, 1.75])
    early = as_acted(one, -0.5)  # a log that is slower than the loop: from row to row
    assert early.columns['voltage'] == pytest.approx([0.0, 2.0, 4.0, 2.5, 1.0, 1.0])
    still = replace(one, columns={'current': np.ones(6)})
    assert as_acted(still, 1.25) is still


def test_every_recording_of_a_diagnosis_is_put_right_and_stays_one():
    one, two = (Recording(name, 1e-3, {'voltage': np.arange(4.0)}) for name in ('one', 'two'))
    split = split_as_acted(Split((one,), (one,), (two,)), 1.0)
    assert split.screen[0] is split.accept[0]
    for each in (*split.screen, *split.report):
        assert each.columns['voltage'] == pytest.approx([0.0, 0.0, 1.0, 2.0])


@pytest.mark.long
@pytest.mark.slow
def test_friction_that_builds_up_within_few_samples_is_found_beside_the_coulomb_friction():
    rig = with_effect('presliding_friction', 'load', level=12.0, breakaway=1e-4, lag=0.0)
    report = answered(rig)
    assert report.verdict['effects'] == ['presliding_friction']
    values = {name: one['value'] for name, one in report.which[0].parameters.items()}
    assert values['level'] == pytest.approx(12.0, rel=0.2)
    assert values['breakaway'] == pytest.approx(1e-4, rel=0.3)
    assert values['effects.coulomb.level'] == pytest.approx(
        SERVO.numbers['effects.coulomb.level'], rel=0.1)


@pytest.mark.long
@pytest.mark.slow
def test_an_error_of_many_numbers_is_found_over_the_turns_of_a_motor():
    rig = with_effect('kinematic_error', 'mesh', order=1.0, cosine=(4e-5, 2e-5, 1e-5),
                      sine=(2e-5, -3e-5, 1e-5))
    assert named_by_equations([recorded(rig, seed) for seed in (1, 2)]) == {
        ('transmission_error', 'mesh')}


@pytest.mark.long
@pytest.mark.slow
def test_a_spring_that_hardens_from_the_stiffness_of_the_file_is_found():
    stiffness = SERVO.numbers['mechanism.stiffness']
    torsion = np.max(np.abs(recorded(SERVO, 1).columns['torque'])) / stiffness
    rig = with_effect('nonlinear_stiffness', 'mesh', soft=0.0, cubic=stiffness / torsion**2)
    found = explained(residual_samples([recorded(rig, seed) for seed in (1, 2)], SERVO))
    search = found.search
    left = [search.power(search.fitted(search.nothing.choice.plus(number, side))).max()
            for number, one in enumerate(found.hypotheses) for side in (0, 1)
            if one.mechanism.name == 'nonlinear_stiffness' and one.either]
    assert min(left) < 0.05 * search.power(search.nothing).max()


@pytest.mark.slow
def test_a_spring_that_is_smoothly_softer_at_small_torque_leaves_the_noise_alone():
    stiffness = SERVO.numbers['mechanism.stiffness']
    torsion = np.max(np.abs(recorded(SERVO, 1).columns['torque'])) / stiffness
    rig = with_effect('nonlinear_stiffness', 'mesh', soft=0.45 * stiffness, reach=0.12 * torsion)
    found = explained(residual_samples([recorded(rig, seed) for seed in (1, 2)], SERVO))
    search = found.search
    left = [search.power(search.fitted(search.nothing.choice.plus(number, 0))).max()
            for number, one in enumerate(found.hypotheses)
            if one.mechanism.name == 'nonlinear_stiffness' and not one.detail]
    assert min(left) < CALIBRATED


@pytest.mark.long
@pytest.mark.slow
def test_a_coupling_that_is_stiffer_one_way_has_a_nonlinear_stiffness():
    difference = 0.15 * SERVO.numbers['mechanism.stiffness']
    rig = with_effect('one_sided_stiffness', 'mesh', difference=difference)
    report = answered(rig)
    assert [(one.effect, one.site) for one in report.which] == [('nonlinear_stiffness', 'mesh')]
    assert report.which[0].parameters['difference']['value'] == pytest.approx(difference, rel=0.1)


@pytest.mark.long
@pytest.mark.slow
def test_friction_that_rises_from_rest_before_it_falls_is_stribeck_friction():
    """Makkar's film: tanh(8 s) - tanh(s / 2), which falls sooner than an eddy brake's 1 / s."""
    angles = recorded(SERVO, 1).columns['motor_position'] / SERVO.numbers['mechanism.ratio']
    speeds = np.linspace(0.0, np.max(np.abs(np.gradient(angles, PERIOD))), 24)
    share = speeds / (0.25 * speeds[-1])
    rig = with_effect('friction_over_speed', 'load', low=0.0, high=float(speeds[-1]),
                      curve=tuple(20.0 * (np.tanh(8.0 * share) - np.tanh(0.5 * share))))
    assert named_by_equations([recorded(rig, seed) for seed in (1, 2)]) == {
        ('stribeck_friction', 'load')}


def test_halves_that_name_another_law_of_the_same_place_do_not_doubt_that_something_is_there():
    soft = Mechanism('stiffness_error', 'mechanism', 'mesh', ('load',), 'odd')
    lost = Mechanism('backlash', 'clearance', 'mesh', ('load',), 'odd')
    wave = Mechanism('transmission_error', 'mesh_error', 'mesh', ('angle',), 'even')
    held = Mechanism('spring_load', 'torque', 'load', ('angle',), 'even')
    halves = [{one.key: one for one in each} for each in (
        (soft, held), (lost, held), (soft,), (held,))]
    assert share_in_place(halves, [lost], [held]) == 0.75
    assert share_in_place(halves, [wave], [held]) == 0.0, 'it depends on another variable'
    assert share_in_place(halves, [lost], [soft]) == 0.25, 'what is told beside stands for itself'
