"""Recordings held against a servo file: the check ..."""

from dataclasses import replace
from math import pi
from pathlib import Path

from bench_recording import bench_recording, without
from checked_bench import BENCH, changed, of_level
import numpy as np
import pytest

from servo_identify.data.reading import read_recordings
from servo_identify.data.recording_check import check
from servo_twin.description.servo_file import load, loads
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

DEGREES = 180.0 / pi
CONFIG = Path(__file__).resolve().parents[2] / 'config'


@pytest.fixture(scope='module')
def good():
    return bench_recording(4.0)


def test_it_finds_no_fault_with_a_good_recording(good):
    found = check([good, good, good], BENCH)
    assert {one.level for one in found} == {'green'}
    assert any('inertia is excited' in one.sentence for one in found)


MISTAKES = {
    'degrees on both shafts': (
        lambda r: changed(r, motor_position=r['motor_position'] * DEGREES,
                          load_position=r['load_position'] * DEGREES), 'degrees'),
    'degrees on the motor': (
        lambda r: changed(r, motor_position=r['motor_position'] * DEGREES),
        'motor_position is in degrees'),
    'angles that no transmission puts so far apart': (
        lambda r: changed(r, motor_position=r['motor_position'] * 652.0),
        'times as far as load_position'),
    'milliseconds': (lambda r: replace(r, period=1e3 * r.period), 'milliseconds'),
    'milliamperes': (lambda r: changed(r, current=1e3 * r['current']), 'mA'),
    'voltage and current swapped': (
        lambda r: changed(r, current=r['voltage'], voltage=r['current']), 'swapped'),
    'a current of the other sign': (lambda r: changed(r, current=-r['current']),
                                    'current has the other sign'),
    'command and current of the other sign': (
        lambda r: changed(r, current=-r['current'], voltage=-r['voltage']), 'opposite sign'),
    'a load that turns the other way': (
        lambda r: changed(r, load_position=-r['load_position']), 'runs against'),
    'a torque sensor of the other sign': (
        lambda r: changed(r, torque=-r['torque']), 'against the torque'),
    'a torque in millinewtonmetres': (lambda r: changed(r, torque=1e3 * r['torque']), 'mN m'),
    'a reference speed in rpm': (
        lambda r: changed(r, reference_velocity=30 / pi * r['reference_velocity']), 'rpm'),
    'no encoder': (lambda r: changed(r, motor_position=np.full(len(r), np.nan),
                                     load_position=np.full(len(r), np.nan)), 'neither'),
    'a current sensor that is not connected': (
        lambda r: changed(r, current=np.zeros(len(r))), 'nothing was measured'),
    'an encoder that wraps around at each turn': (
        lambda r: changed(r, motor_position=r['motor_position'] % (2.0 * pi)),
        'jumps back'),
    'a counter that wraps around': (
        lambda r: changed(r, motor_position=(r['motor_position'] + 12.5) % 25.0 - 12.5),
        'jumps back by 2'),
    'no motion': (lambda r: changed(r, motor_position=np.zeros(len(r)),
                                    load_position=np.zeros(len(r))), 'nothing moves'),
}


@pytest.mark.parametrize('mistake', MISTAKES)
def test_it_is_red_and_says_what_to_do_about(good, mistake):
    spoil, word = MISTAKES[mistake]
    red = of_level('red', spoil(good))
    assert any(word in one.sentence for one in red), red
    assert all(one.action for one in red)


@pytest.mark.parametrize(('channel', 'spoil', 'words'), [
    ('current', np.abs, 'never changes its sign'),
    ('voltage', lambda x: 24.0 - 0.01 * np.abs(x), 'the voltage of the supply')])
def test_it_asks_whether_a_channel_is_that_of_the_supply(good, channel, spoil, words):
    def said(recording):
        return [one for one in of_level('amber', recording) if words in one.sentence]

    assert not said(good)
    found, = said(changed(good, **{channel: spoil(good[channel])}))
    assert 'motor' in found.action


def test_a_command_and_a_current_of_one_sign_but_for_noise_raise_no_question(good):
    def said(voltage):
        both = changed(good, current=np.abs(good['current']), voltage=voltage)
        return [one for one in of_level('amber', both) if 'never changes its sign' in one.sentence]

    told = np.abs(good['voltage'])
    assert not said(told - 0.01 * told.max())
    assert said(told - 0.1 * told.max())


def test_a_current_that_holds_a_weight_is_no_magnitude(good):
    lifting = good['current'] + 1.3 * np.abs(good['current']).max()
    assert not [one for one in of_level('amber', changed(good, current=lifting))
                if 'never changes its sign' in one.sentence]


@pytest.mark.parametrize('rows', [1, 40], ids=['a spike', 'a while'])
def test_it_asks_of_an_angle_that_jumps_whether_a_sensor_dropped_out(good, rows):
    def said(recording):
        return [one for one in of_level('amber', recording) if 'dropped out' in one.sentence]

    assert not said(good)
    angle = good['motor_position'].copy()
    at = int(np.argmax(angle > 0.6 * angle.max()))  # on its way up
    angle[at:at + rows] = 0.0
    found, = said(changed(good, motor_position=angle))
    assert f'first after {good.time[at]:.6g} s' in found.sentence and 'empty' in found.action
    angle[at:at + rows] = np.nan
    assert not said(changed(good, motor_position=angle))


def test_it_warns_of_lost_samples_missing_channels_and_single_recordings(good):
    nothing = np.full(len(good), np.nan)
    lacking = changed(without(good, slice(500, 700)), load_position=nothing, torque=nothing,
                      current=nothing)
    said = ' '.join(one.sentence for one in of_level('amber', lacking))
    for word in ('missing in 5.0 %', 'one encoder', 'Without the current', 'torque sensor',
                 'There is one recording only'):
        assert word in said
    assert not of_level('red', lacking)


def test_it_finds_nothing_good_in_units_where_a_recording_is_too_short_to_tell(good):
    short = replace(good, columns={name: column[:60] for name, column in good.columns.items()})
    assert any('lasts' in one.sentence for one in of_level('amber', short))
    assert not any('unit' in one.sentence for one in of_level('green', short))


@pytest.mark.parametrize(('machine', 'pattern'), [
    ('emps', 'emps/*.mat'), ('two_mass', 'two_mass/*.mat'), ('xl330', 'xl330*/*.json')])
def test_it_is_never_red_on_recordings_of_real_machines(shared_data, machine, pattern):
    servo = CONFIG / 'servos' / f'{machine}.yaml'
    recordings = read_recordings([shared_data / pattern], servo,
                                 CONFIG / 'imports' / f'{machine}.yaml')
    assert recordings
    assert [one for one in check(recordings, load(servo)) if one.level == 'red'] == []


@pytest.mark.parametrize('name', ['kp400_sin_time_square', 'kp400_sin_sin'])
def test_it_sees_degrees_where_there_is_one_encoder_and_no_current(shared_data, name):
    servo = CONFIG / 'servos' / 'xl330.yaml'
    one, = read_recordings([shared_data / 'xl330' / f'{name}.json'], servo,
                           CONFIG / 'imports' / 'xl330.yaml')
    angles = {n: one[n] * DEGREES for n in ('motor_position', 'reference_position')}
    red = of_level('red', changed(one, **angles), load(servo))
    assert any('degrees' in finding.sentence for finding in red)


def test_it_asks_whether_a_torque_was_computed_from_the_current(good):
    computed = changed(good, torque=3.3 * good['current'])
    said, = [one for one in check([computed], BENCH) if 'computed' in one.sentence]
    assert said.level == 'amber' and '3.3 N m/A times the current' in said.sentence
    assert not any('computed' in one.sentence for one in check([good], BENCH))


def test_a_pendulum_that_falls_with_the_drive_off_is_not_taken_for_degrees():
    servo = loads("""
servo: pendulum
step: 1.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.05}
mechanism: {type: rigid, rotor_inertia: 1.0e-5, load_inertia: 0.05, ratio: 6.0}
sensors: {load_encoder: {noise: 1.0e-4}, current_sensor: {noise: 0.01}}
effects:
  weight: {effect: gravity, at: load, cosine: 0.0, sine: -5.0}
  dry: {effect: coulomb_friction, at: load, level: 0.1}
""")
    chance = np.random.default_rng(1)
    columns = {name: np.full(4000, np.nan) for name in COLUMNS} | {'voltage': np.zeros(4000)}
    y = simulate(servo, inputs_of(columns), 2e-3, initial_state(servo, 6.0 * 2.5, 2.5))
    columns = columns | {'load_position': y[:, 1] + 1e-4 * chance.normal(size=4000),
                         'current': 0.01 * chance.normal(size=4000),
                         'voltage': np.full(4000, np.nan)}
    assert np.ptp(columns['load_position']) > 1.0
    fall = Recording('fall', 2e-3, columns, family='fall')
    assert not any(one.level == 'red' for one in check([fall], servo))
