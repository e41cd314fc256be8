"""What recordings of one machine say against each other, and encoders: the check ..."""

from dataclasses import replace

from bench_recording import bench_recording, SERVO
import numpy as np
import pytest

from servo_identify.data.recording_check import check
from servo_rig_driver.emulated.make_recording import make_recording
from servo_twin.description.servo_file import load
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, PREDICTED, Recording

BENCH, CONFIG = load(SERVO), SERVO.parents[1]


def run(number, coulomb=22.0, zero=0.0):
    """Return a recording of the bench with noise of its own, and a zero of the torque, N m."""
    one, chance = bench_recording(4.0, coulomb), np.random.default_rng(number)
    noisy = {name: one[name] + BENCH.noise(name) * chance.standard_normal(len(one))
             for name in ('motor_position', 'load_position', 'torque', 'current')}
    noisy['torque'] = noisy['torque'] + zero
    return replace(one, name=f'run_{number}', columns={**one.columns, **noisy})


def said(recordings, words, servo=BENCH):
    return [one for one in check(recordings, servo) if words in one.sentence]


def test_it_finds_no_drift_between_recordings_that_are_alike():
    assert not said([run(k) for k in range(4)], 'differs between')


@pytest.mark.parametrize(('changed', 'words'), [
    ({'zero': 0.5}, 'run_3 has 1.5 +- '), ({'coulomb': 2.0}, 'run_3 has 5.9')])
def test_it_names_what_differs_between_recordings_with_its_size(changed, words):
    several = [run(k, 22.0 + changed.get('coulomb', 0.0) * k, changed.get('zero', 0.0) * k)
               for k in range(4)]
    found, = said(several, 'differs between recordings of sine')
    assert ('zero of torque' if 'zero' in changed else 'friction of the load') in found.sentence
    assert words in found.sentence and 'more than run_0' in found.sentence
    assert found.level == 'amber' and ('tare' if 'zero' in changed else
                                       'what drags in run_2, run_3:') in found.action


def joint(slopes, levels=(0.01,) * 5):
    """Return recordings of a geared joint, one a friction (motor side); their servo; no torque."""
    servo = load(CONFIG / 'servos' / 'odrive.yaml').with_values({'mechanism.ratio': 9.0})
    values, time, made = servo.values, np.arange(8000) * 1e-3, []
    for k, (slope, level) in enumerate(zip(slopes, levels, strict=False)):
        chance = np.random.default_rng(k)
        tones = [(3.0, 12.0), (1.4, 9.0), (0.7, 3.1)]
        angle, speed, acceleration = (
            sum(size * factor * of(rate * time + k) for size, rate in tones
                for factor in (rate**order,)) * sign
            for order, of, sign in ((0, np.sin, 1.0), (1, np.cos, 1.0), (2, np.sin, -1.0)))
        torque = (values['mechanism.rotor_inertia'] + values['mechanism.load_inertia'] / 81.0
                  ) * acceleration + level * np.sign(speed) + slope * speed
        nothing = {name: np.full(len(time), np.nan) for name in COLUMNS}
        made.append(Recording(f'run_{k}', 1e-3, {
            **nothing, 'motor_position': angle + 1e-5 * chance.standard_normal(len(time)),
            'current': torque / values['drive.torque_constant']
            + 0.01 * chance.standard_normal(len(time))}))
    return made, servo


def test_it_tells_friction_that_drifts_with_its_slope_at_the_largest_speed():
    several, servo = joint((1e-3, 8e-4, 6e-4, 4e-4, 2e-4))
    found, = said(several, 'The friction differs', servo)
    size = float(found.sentence.split(' has ')[1].split()[0])
    speed = float(found.sentence.split(' at ')[1].split()[0])
    assert 'run_0 has' in found.sentence and 'than run_4 at ' in found.sentence
    assert size == pytest.approx(8e-4 * speed, rel=0.1)
    assert found.sentence.endswith('at the motor shaft.')


def test_it_advises_warmth_only_where_friction_falls_from_recording_to_recording():
    several, servo = joint((2e-4,) * 5, (0.05, 0.045, 0.04, 0.03, 0.02))
    action = said(several, 'The friction differs', servo)[0].action
    assert 'warm up' in action and 'friction_drift' in action
    several, servo = joint((2e-4,) * 5, (0.02, 0.05, 0.02, 0.05, 0.02))
    found, = said(several, 'The friction differs', servo)
    assert 'drags in run_1, run_3:' in found.action and 'warm up' not in found.action


def at_speed(number, speed, coulomb=22.0):
    """Return moves to and fro of a bench with Stribeck friction, of one speed in rad/s."""
    rig = BENCH.with_effects(Placed('static', find('stribeck_friction'), 'load'), values={
        'effects.static.excess': 12.0, 'effects.static.fade': 0.1,
        'effects.coulomb.level': coulomb})
    one, time = run(number), np.arange(4000) * 1e-3
    columns = {name: np.full(4000, np.nan) for name in one.columns}
    columns['reference_velocity'] = speed * np.tanh(8.0 * np.sin(1.57 * time))
    made = simulate(rig, inputs_of(columns), 1e-3, initial_state(rig), 'closed_loop')
    columns.update(zip(PREDICTED, made.T.copy(), strict=True))
    chance = np.random.default_rng(number)
    for name in ('motor_position', 'load_position', 'torque', 'current'):
        columns[name] += BENCH.noise(name) * chance.standard_normal(4000)
    return replace(one, columns=columns)


def test_friction_at_other_speeds_is_no_friction_that_drifts():
    assert not said([at_speed(k, 0.05 * (k + 1)) for k in range(4)], 'differs between')
    found, = said([at_speed(k, 0.2, 22.0 + 3.0 * k) for k in range(4)], 'differs between')
    assert 'friction of the load' in found.sentence  # and not of the motor, which is the same


def test_it_holds_only_recordings_of_one_motion_against_each_other():
    several = [replace(run(k, zero=k), family=f'motion {k}') for k in range(3)]
    assert not said(several, 'differs between')


def test_it_says_that_two_encoders_contradict_the_ratio_of_the_file():
    belt = BENCH.with_values({'mechanism.ratio': 161.0 / 1.03})
    found, = said([run(0)], 'encoders show a ratio', belt)
    assert found.level == 'amber' and 'a ratio of 161 +- ' in found.sentence
    assert 'mechanism.ratio is 156.311: +3 %' in found.sentence
    assert 'count the teeth' in found.action
    assert not said([run(0)], 'encoders show a ratio')


def test_it_leaves_a_ratio_within_its_tolerance_alone():
    belt = BENCH.with_values({'mechanism.ratio': 161.0 / 1.03})
    wide = replace(belt, tolerance={**belt.tolerance, 'mechanism.ratio': (150.0, 162.0)})
    assert not said([run(0)], 'encoders show a ratio', wide)


def test_one_sine_does_not_tell_a_ratio_from_a_twist():
    time = np.arange(4000) * 1e-3
    angle = 0.2 * np.sin(20.0 * time)
    one = run(0)
    columns = {name: np.full(4000, np.nan) for name in one.columns}
    chance = np.random.default_rng(2)
    for name, size in (('load_position', 1.0), ('motor_position', 161.0 * 1.03)):
        columns[name] = size * angle + BENCH.noise(name) * chance.standard_normal(4000)
    assert not said([replace(one, columns=columns)], 'encoders show a ratio')


@pytest.mark.parametrize(('channel', 'per', 'word'), [('load_position', 1.0, 'less'),
                                                      ('motor_position', 161.0, 'more')])
@pytest.mark.parametrize('slip', [True, False])
def test_it_says_of_two_encoders_that_part_for_good_by_how_much(channel, per, word, slip):
    one = run(0)
    share = np.arange(len(one)) > 0.4 * len(one) if slip else np.linspace(0.0, 1.0, len(one))
    apart = replace(one, columns={**one.columns, channel: one[channel] + 0.2 * per * share})
    found, = said([apart], 'at the same place')
    assert found.level == 'amber' and f'rad {word} at the end than at the start' in found.sentence
    size = float(found.sentence.split(' rad ')[0].split()[-1])
    assert size == pytest.approx(0.2 if slip else 0.15, rel=0.1)
    assert 'slips' in found.action
    assert not said([apart], 'cannot tell whether') and not said([apart], 'closes')


@pytest.mark.parametrize('back', [0.6, 0.7])
def test_it_says_of_a_clutch_that_slips_back_when_it_did(back):
    one, share = run(0), np.linspace(0.0, 1.0, 4000)
    slipped = one['load_position'] + 0.05 * ((share > 0.3) & (share < back))
    found, = said([replace(one, columns={**one.columns, 'load_position': slipped})],
                  'at the same place')
    assert found.level == 'amber' and '0.05 rad' in found.sentence and 'quarter' in found.sentence


@pytest.mark.parametrize('rig', ['ema_bench', 'pan_tilt_azimuth', 'pan_tilt_elevation'])
def test_a_twist_over_a_small_motion_is_no_other_ratio(rig):
    made = make_recording('slow_reversals', CONFIG / 'rigs' / f'{rig}.yaml', duration=5.0,
                          rate=500.0, seed=1)
    one = Recording(rig, 0.002, {name: made[name] for name in COLUMNS if name in made})
    assert not said([one], 'encoders show a ratio', load(CONFIG / 'servos' / f'{rig}.yaml'))


def test_two_encoders_that_hold_raise_no_word():
    assert not said([run(0)], 'at the same place')


@pytest.mark.parametrize(('known', 'wrong'), [(True, 1.0), (False, 1.0), (True, 1.05)])
def test_a_spring_that_a_known_weight_winds_up_is_no_other_ratio(known, wrong):
    values = {'mechanism.stiffness': 26.0, 'mechanism.load_inertia': 1e-3, 'mechanism.ratio': 12.0}
    smooth = {path: 0.0 for path in BENCH.values if path.rpartition('.')[2] in ('level', 'slope')}
    limb = Placed('limb', find('gravity'), 'load')
    servo = BENCH.with_values(values | smooth).with_effects(limb, values={
        'effects.limb.sine': 0.3 if known else 0.0, 'effects.limb.cosine': 0.0})
    time, chance = np.arange(8000) * 1e-3, np.random.default_rng(3)
    angle = 0.9 * np.sin(1.1 * time) + 0.3 * np.sin(2.7 * time)
    nothing = {name: np.full(len(time), np.nan) for name in COLUMNS}
    motor = 12.0 * wrong * (angle + 0.3 * np.sin(angle) / 26.0)
    one = Recording('finger', 1e-3, {
        **nothing, 'load_position': angle + 1e-5 * chance.standard_normal(len(time)),
        'motor_position': motor + 1e-4 * chance.standard_normal(len(time))})
    assert bool(said([one], 'encoders show a ratio', servo)) == (not known or wrong != 1.0)


def test_a_clearance_and_a_spring_that_the_current_shows_are_no_other_ratio():
    smooth = {path: 0.0 for path in BENCH.values if path.rpartition('.')[2] in ('level', 'slope')}
    servo = BENCH.with_values(smooth | {
        'mechanism.stiffness': 900.0, 'mechanism.ratio': 18.0, 'mechanism.load_inertia': 0.05,
        'mechanism.rotor_inertia': 1e-6}).with_effects(
        Placed('centring', find('spring_load'), 'load'), values={
            'effects.centring.stiffness': 25.0, 'effects.centring.rest': 0.0})
    time, chance = np.arange(8000) * 1e-3, np.random.default_rng(3)
    waves = ((0.5, 1.9), (0.08, 12.6))
    angle = sum(size * np.sin(rate * time) for size, rate in waves)
    torque = sum((25.0 - 0.05 * rate**2) * size * np.sin(rate * time) for size, rate in waves)
    motor = 18.0 * (angle + torque / 900.0 + 0.009 * np.tanh(torque / 6.0))
    one = Recording('steering', 1e-3, {
        **{name: np.full(len(time), np.nan) for name in COLUMNS},
        'load_position': angle + 1e-5 * chance.standard_normal(len(time)),
        'motor_position': motor + 1e-4 * chance.standard_normal(len(time)),
        'current': torque / 18.0 / servo.numbers['drive.torque_constant']})
    assert not said([one], 'encoders show a ratio', servo)
