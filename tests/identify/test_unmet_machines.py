"""What machines that had no part in building the diagnosis asked of it."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recordings import PERIOD, sampled
from test_selection import (
    answered,
    diagnosed,
    named_by_equations,
    recorded,
    SERVO,
    with_effect,
)

from servo_identify.data.encoder_count import count_of
from servo_identify.data.table_import import import_table
from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.mechanisms.builder import Builder
from servo_identify.diagnose.mechanisms.every_hypothesis import hypotheses_of
from servo_identify.diagnose.mechanisms.orders import strongest
from servo_identify.diagnose.residuals.noise import of_encoders, one_count
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained
from servo_identify.diagnose.splitting import split
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import OUTPUTS
from servo_twin.recording.recording import COLUMNS, Recording


@pytest.mark.long
def test_an_error_over_the_motors_turn_may_leave_the_motor_alone():
    ratio = SERVO.numbers['mechanism.ratio']  # an effect of the load's turn does not act back
    rig = with_effect('transmission_error', 'mesh', order=2.0 * ratio, cosine=(2e-4,),
                      sine=(1e-4,))
    assert named_by_equations([recorded(rig, seed) for seed in (1, 2)]) == {
        ('transmission_error', 'mesh')}


@pytest.mark.long
@pytest.mark.slow
def test_a_clearance_that_takes_the_load_up_over_a_little_is_a_clearance():
    rig = with_effect('load_dependent_backlash', 'mesh', growth=4e-4, load=2.0)
    report = answered(rig)
    assert report.which[0].effect == 'backlash'


@pytest.mark.long
@pytest.mark.slow
def test_a_lag_of_second_order_is_no_delay():
    lag = with_effect('current_lag', 'current', lag=0.012)
    twice = lag.with_effects(replace(lag.effects[-1], name='e2'), values={'effects.e2.lag': 0.012})
    found = explained(residual_samples([recorded(twice, seed) for seed in (1, 2)], SERVO))
    assert {one.mechanism.name for one in found.chosen} == {'current_lag'}


def test_a_motion_that_no_other_recording_repeats_is_not_held_out():
    def one(family, replicate):
        return Recording(f'{family}_{replicate}', 1e-3, {'voltage': np.zeros(10)}, family=family,
                         replicate=replicate, digest=f'{family}{replicate}')

    parts = split([one('chirp', 1), one('squat', 1), one('squat', 2), one('swing', 1),
                   one('swing', 2)], [], [])
    assert [r.name for r in parts.screen] == ['chirp_1', 'squat_1', 'swing_1']
    assert {r.name for r in (*parts.accept, *parts.report)} == {'squat_2', 'swing_2'}


KNEE = servo_file.loads("""
servo: knee
step: 1.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.091}
mechanism: {type: rigid, rotor_inertia: 6.1e-5, load_inertia: 0.048, ratio: 9.0}
controller: {type: impedance, kp: 60.0, kd: 1.2, kf: 1.0, command_torque: 0.819, filter: 0.001,
             torque_limit: 30.0, on_load: 0.0}
sensors:
  motor_encoder: {noise: 1.0e-4}
  current_sensor: {noise: 0.02}
effects:
  rubs: {effect: coulomb_friction, at: load, level: 0.35}
  drags: {effect: viscous_friction, at: load, slope: 0.02}
""")
WITHIN = 20  # turns of the drive's own loop to a row


def told(seed):
    """Return rows of a drive whose own loop is faster, its current read as a row's target came."""
    fine = np.arange(100_000) * 1e-4
    rows = fine[::WITHIN]
    place, rate = (sum(0.3 * factor(f) * wave(2.0 * np.pi * f * rows + seed) for f in (0.4, 1.3))
                   for factor, wave in ((lambda f: 1.0, np.sin),
                                        (lambda f: 2.0 * np.pi * f, np.cos)))
    columns = {name: np.full(len(fine), np.nan) for name in COLUMNS}
    columns['reference_position'] = np.repeat(place, WITHIN)
    columns['reference_velocity'] = np.repeat(rate, WITHIN)
    y = simulate(KNEE, inputs_of(columns), 1e-4,
                 initial_state(KNEE, 9.0 * place[0], place[0], load_speed=rate[0]), 'closed_loop')
    chance = np.random.default_rng(seed)
    seen = {name: np.full(len(rows), np.nan) for name in COLUMNS}
    seen |= {'reference_position': place, 'reference_velocity': rate,
             'motor_position': y[::WITHIN, 0] + 1e-4 * chance.standard_normal(len(rows)),
             'current': y[1::WITHIN, 3] + 0.02 * chance.standard_normal(len(rows))}
    return Recording(f'swing {seed}', 1e-4 * WITHIN, seen, family='swing', digest=f'{seed:064d}')


@pytest.mark.long
@pytest.mark.slow
def test_a_current_read_as_a_target_came_is_no_friction():
    assert named_by_equations([told(seed) for seed in (1, 2)], KNEE) == set()


def test_a_controller_is_not_judged_on_rows_that_are_not_even(tmp_path):
    chance = np.random.default_rng(0)
    time = np.arange(2000) * 5e-3 + chance.uniform(0.0, 2e-3, 2000)
    wanted = np.sin(2.0 * np.pi * 0.4 * time)
    angle = 0.8 * np.sin(2.0 * np.pi * 0.4 * time - 0.3) + chance.normal(0.0, 4e-4, 2000)
    path = tmp_path / 'log.csv'
    np.savetxt(path, np.column_stack((time, 30.0 * (wanted - angle), angle, wanted)), '%.6f', ',',
               comments='', header='t,voltage,motor_position,reference_position')
    host = servo_file.loads("""
servo: host
step: 5.0e-4
drive: {type: voltage, resistance: 4.0, inductance: 0.0, back_emf: 1.3, torque_constant: 1.3}
mechanism: {type: rigid, rotor_inertia: 0.013, load_inertia: 9.7e-3, ratio: 1.0}
controller: {type: position_loop, kp: 1.0, kv: 30.0, ki: 0.0, kd: 0.0, limit: 40.0}
sensors: {motor_encoder: {noise: 4.4e-4}}
""")
    read = import_table(path, None)
    assert read.resampled
    assert 'controller' not in residual_samples([read], host).present
    even = replace(read, note='')  # the same rows, had they been even
    assert 'controller' in residual_samples([even], host).present


ELBOW = servo_file.loads("""
servo: elbow
step: 1.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.115}
mechanism: {type: two_inertia, rotor_inertia: 5.5e-5, load_inertia: 0.62, ratio: 100.0,
            stiffness: 1.3e4, damping: 8.0}
controller: {type: cascade, kp: 12.0, kv: 1.6, ki: 12.0, filter: 0.002, speed_limit: 4.0,
             limit: 6.0}
sensors:
  motor_encoder: {noise: 1.2e-4}
  load_encoder: {noise: 3.5e-6}
  torque_sensor: {noise: 0.05}
  current_sensor: {noise: 0.01}
effects:
  arm: {effect: gravity, at: load, cosine: 17.7, sine: 0.0}
  bearing: {effect: coulomb_friction, at: load, level: 1.5}
""")


def held_up(rig, family, seed):
    """Return a recording of an arm that its motor holds up: slowly about one load, or fast."""
    time = np.arange(8000) * 1e-3
    rates, size = {'slow': ((0.1,), 0.15), 'fast': ((0.7, 1.6), 0.25)}[family]
    wanted = size * sum(np.sin(2.0 * np.pi * f * time + seed + f) for f in rates)
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['reference_position'] = wanted
    y = simulate(rig, inputs_of(columns), 1e-3, initial_state(rig, 100.0 * wanted[0]),
                 'closed_loop')
    chance = np.random.default_rng(seed)
    for k, name in enumerate(OUTPUTS):
        columns[name] = y[:, k] + rig.noise(name) * chance.standard_normal(len(time))
    return Recording(f'{family}_{seed}', 1e-3, columns, family=family, digest=f'{family}{seed}')


@pytest.mark.long
@pytest.mark.slow
def test_a_motion_that_fits_already_does_not_hold_a_curve_from_the_others():
    rig = ELBOW.with_effects(Placed('e', find('nonlinear_stiffness'), 'mesh'), values={
        'effects.e.soft': 7000.0, 'effects.e.reach': 8e-4})
    several = [held_up(rig, family, seed) for family in ('slow', 'fast') for seed in (1, 2)]
    found = explained(residual_samples(several, ELBOW))
    bent = next(number for number, one in enumerate(found.hypotheses)
                if one.mechanism.name == 'nonlinear_stiffness' and 'form' not in one.detail)
    nothing = found.search.nothing
    left = found.search.power(found.search.fitted(nothing.choice.plus(bent, 0)))
    assert left.max() < 0.05 * found.search.power(nothing).max()


def test_what_columns_do_not_reach_is_no_sample():
    samples = residual_samples([recorded(SERVO, 1)], SERVO)
    one = samples.errors[0]
    there = one.full(np.ones(len(one.motion.rows)))
    for equation in samples.present:
        known = np.isfinite(one.test(equation).project(there))
        assert known[samples.kept(0, equation)].all()


def test_a_clearance_over_the_angle_has_its_whole_width():
    samples = residual_samples([recorded(SERVO, 1)], SERVO)
    several = hypotheses_of(Builder(samples), samples.base)
    over_angle, = (one for one in several if one.detail.get('form') == 'curve'
                   and one.mechanism.name == 'position_dependent_backlash')
    constant, = (one for one in several if one.mechanism.name == 'backlash')
    assert over_angle.columns.whole().sum(axis=1) == pytest.approx(
        constant.columns.whole()[:, 0], abs=1e-6 * np.abs(constant.columns.whole()).max())


def test_a_count_is_found_under_the_decimals_of_a_table():
    chance, count = np.random.default_rng(0), 2.0 * np.pi / 2**19
    angle = 0.1 * np.sin(np.arange(4000) / 300.0) + chance.normal(0.0, 0.3 * count, 4000)
    counts = np.degrees(count * np.round(angle / count))
    assert count_of(np.radians(np.round(counts, 5))) == pytest.approx(count, rel=1e-3)
    assert count_of(np.radians(np.round(np.degrees(angle), 5))) == pytest.approx(
        np.radians(1e-5), rel=1e-3)


@pytest.mark.parametrize('written', ['%.6g', '%.5f', '%.17g'])
def test_a_count_is_found_where_a_table_has_few_digits(written):
    count = np.radians(300.0) / 1024
    angle = count * np.round(1.2 * np.sin(np.arange(4000) / 200.0) / count)
    assert count_of(np.array([float(written % one) for one in angle])) == pytest.approx(
        count, rel=1e-3)


@pytest.mark.parametrize('digits', [6, 12])
def test_a_few_rows_that_were_made_up_hide_no_count(digits):
    """A wave of 500 a turn had been an encoder that is not round: the rounding to its counts."""
    time, count = np.arange(0.0, 20.0, 2e-3), 2.0 * np.pi / 500
    angle = np.round(count * np.round(9.0 * np.sin(1.7 * time) / count), digits)
    made_up = np.random.default_rng(0).choice(len(time) - 1, 25, replace=False)
    angle[made_up] = 0.6 * angle[made_up] + 0.4 * angle[made_up + 1]
    assert count_of(angle) == pytest.approx(count, rel=1e-3)
    noisy = angle + np.random.default_rng(1).normal(0.0, count, len(time))
    assert count_of(noisy) < 1e-3 * count
    same = one_count([{'motor_position': 0.0, 'load_position': 0.0},
                      {'motor_position': count, 'load_position': 0.0}])
    assert [one['motor_position'] for one in same] == [count, count]


def test_no_wave_is_sought_that_is_shorter_than_two_counts():
    angle = np.linspace(0.0, 60.0, 60000)
    target, factor = np.cos(500.0 * angle), np.ones(len(angle))
    assert strongest(angle, target, factor, 1.0)[0][0] == 500.0
    found, _ = strongest(angle, target + 0.1 * np.cos(12.0 * angle), factor, 1.0, largest=250.0)
    assert found[0] == 12.0 and max(found) <= 250.0


def test_an_encoder_that_rests_on_a_count_is_no_quieter():
    several = of_encoders([{'motor_position': s, 'load_position': np.nan, 'current': s}
                           for s in (4e-4, 5e-4, 1e-4)])
    assert [one['motor_position'] for one in several] == [4e-4, 5e-4, 4e-4]
    assert [one['current'] for one in several] == [4e-4, 5e-4, 1e-4]


@pytest.mark.long
@pytest.mark.slow
def test_a_weight_on_a_slope_is_a_torque_that_is_always_there():
    rig = with_effect('constant_torque', 'load', torque=-60.0)
    report = answered(rig)
    names = {report.which[0].effect, *report.which[0].ambiguous_with}
    assert 'constant_torque' in names
    assert names <= {'constant_torque', 'asymmetric_friction', 'spring_load', 'gravity'}


@pytest.mark.long
@pytest.mark.slow
def test_friction_that_one_direction_has_alone_is_one_effect():
    rig = with_effect('asymmetric_friction', 'load', difference=8.0).with_effects(
        Placed('more', find('coulomb_friction'), 'load'), values={'effects.more.level': 8.0})
    report = answered(rig)
    assert [one.effect for one in report.which] == ['asymmetric_friction']
    assert report.which[0].parameters['difference']['value'] == pytest.approx(8.0, rel=0.1)


def axis_of(servo, seed):
    """Return a linear axis under several sines, without its current."""
    time = np.arange(6000) * PERIOD
    command = sum(0.9 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.4, 1.1, 2.3))
    one = sampled(servo, command, seed=seed)
    gone = {name: np.full(len(one), np.nan) for name in ('current', 'torque', 'load_position')}
    return replace(one, columns={**one.columns, **gone}, name=f'sines_{seed}', family='sines')


@pytest.mark.long
def test_friction_over_speed_is_split_once_though_several_hypotheses_hold_it():
    axis = servo_file.load(servo_at('emps'))
    rig = axis.with_effects(Placed('uneven', find('asymmetric_friction'), 'load'), values={
        'effects.uneven.difference': -2.0, 'effects.uneven.slope': -30.0})
    servo = axis.without_effects(lambda placed: placed.name == 'coulomb')
    several = [axis_of(rig, seed) for seed in (1, 2, 3)]
    report = diagnose(several, servo).report
    print(report.verdict['sentence'])
    names = [(one.effect, one.site) for one in report.which]
    assert names[0] == ('coulomb_friction', 'load') and len(set(names)) == len(names)
    assert report.which[0].parameters['level']['value'] == pytest.approx(
        axis.numbers['effects.coulomb.level'], rel=0.1)
    blind = diagnose(several, servo, without=['coulomb_friction']).report
    assert 'coulomb_friction' not in blind.verdict['effects']
    assert blind.verdict['status'] != 'no_gap'


@pytest.mark.long
def test_where_no_current_is_measured_resistance_and_torque_constant_are_both_to_be_measured():
    servo = servo_file.load(servo_at('geared_dc'))
    rig = replace(servo, values={**servo.values, 'drive.resistance': 1.3 * servo.values[
        'drive.resistance']})

    def recorded(seed):
        time = np.arange(5000) * PERIOD
        volts = sum(1.5 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f)
                    for f in (0.5, 1.3, 3.1, 7.0))
        one = sampled(rig, volts, seed=seed)
        gone = {name: np.full(len(one), np.nan) for name in ('current', 'torque')}
        return replace(one, columns={**one.columns, **gone}, name=f'multisine_{seed}',
                       family='multisine')

    report = diagnose([recorded(seed) for seed in (1, 2, 3, 4)], servo).report
    print(report.verdict['sentence'])
    first, = report.which
    assert {first.effect, *(one.effect for one in first.alternatives)} >= {
        'torque_constant_error', 'parameter:resistance'}
    assert first.confidence['mechanism'] < 0.9
    meter, = (line for line in report.confirm if 'resistance' in line)
    assert 'ohmmeter' in meter and '2.2 ohm' in meter


@pytest.mark.long
@pytest.mark.slow
def test_a_spring_whose_force_fades_is_neither_a_spring_nor_friction():
    rig = with_effect('relaxing_spring', 'load', stiffness=60.0, time=0.2)
    answer = diagnosed(rig)
    assert [one.effect for one in answer.report.which] == ['relaxing_spring']
    found = answer.augmented.numbers
    assert found['effects.relaxing_spring.stiffness'] == pytest.approx(60.0, rel=0.1)
    assert found['effects.relaxing_spring.time'] == pytest.approx(0.2, rel=0.1)
