"""Recordings held against a servo file: the check ..."""

from dataclasses import replace
import json
from math import pi
from pathlib import Path

from bench_recording import bench_recording, SERVO, without
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.check import check
from servo_identify.data.reading import files_of, read_recordings
from servo_identify.diagnose.splitting import split
from servo_rig_driver.emulated.make_recording import make_recording
from servo_twin.bag import write_recording
from servo_twin.description.servo_file import load, loads
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

DEGREES = 180.0 / pi
CONFIG = Path(__file__).resolve().parents[2] / 'config'
BENCH = load(SERVO)


@pytest.fixture(scope='module')
def good():
    return bench_recording(4.0)


def of_level(level, recording, servo=BENCH):
    return [one for one in check([recording], servo) if one.level == level]


def changed(recording, **columns):
    return replace(recording, columns={**recording.columns, **columns})


def test_it_finds_no_fault_with_a_good_recording(good):
    found = check([good, good, good], BENCH)
    assert {one.level for one in found} == {'green'}
    assert any('inertia is excited' in one.sentence for one in found)


def test_it_tells_a_copy_of_a_recording_and_reads_a_file_once(good, tmp_path):
    copy = replace(good, name='copy', columns={name: column.copy()
                                               for name, column in good.columns.items()})
    told = [one.sentence for one in check([good, copy], BENCH) if 'same samples' in one.sentence]
    assert told and told[0].startswith(f'copy holds the same samples as {good.name}')
    other = changed(copy, current=np.where(np.arange(len(copy)) == 7, 0.1, copy['current']))
    assert not any('same samples' in one.sentence for one in check([good, other], BENCH))
    for name in ('run_1.csv', 'run_2.csv'):
        (tmp_path / name).write_text('t,motor_position\n0,0\n0.1,1\n')
    assert [one.name for one in files_of([tmp_path / '*.csv', tmp_path / 'run_1.csv'])] == [
        'run_1.csv', 'run_2.csv']


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
    begins = np.where(np.arange(len(lifting)) < 20, 0.0, lifting)  # at rest, on its stop
    for current in (lifting, begins):
        assert not [one for one in of_level('amber', changed(good, current=current))
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


def test_it_warns_of_an_inertia_that_is_far_from_that_of_the_file(good):
    heavy = BENCH.with_values({'mechanism.load_inertia': 10 * 5.76,
                               'mechanism.rotor_inertia': 1.14e-3})
    servo = replace(heavy, tolerance={})
    assert any('times the inertia' in one.sentence for one in of_level('amber', good, servo))


@pytest.mark.parametrize('rig', ['dc_gearmotor', 'ema_bench', 'rv_bench', 'rv_plain'])
def test_friction_of_a_creeping_motion_is_no_inertia(rig):
    made = make_recording('slow_reversals', CONFIG / 'rigs' / f'{rig}.yaml', duration=5.0,
                          rate=500.0, seed=1)
    one = Recording(rig, 0.002, {name: made[name] for name in COLUMNS if name in made})
    assert not [finding for finding in check([one], load(CONFIG / 'servos' / f'{rig}.yaml'))
                if 'times the inertia' in finding.sentence]


def test_command_and_current_in_milliamperes_are_red_where_the_inertia_alone_speaks():
    servo = load(CONFIG / 'servos' / 'odrive.yaml')
    values = servo.values
    time = np.arange(4000) * 1e-3
    angle = 4.0 * np.sin(9.0 * time) + 2.0 * np.sin(31.0 * time)
    acceleration = -4.0 * 81.0 * np.sin(9.0 * time) - 2.0 * 961.0 * np.sin(31.0 * time)
    current = 1e3 * acceleration / values['drive.torque_constant'] * (
        values['mechanism.rotor_inertia']
        + values['mechanism.load_inertia'] / values['mechanism.ratio']**2)
    nothing = {name: np.full(len(time), np.nan) for name in COLUMNS}
    one = Recording('arm', 1e-3, {**nothing, 'motor_position': angle, 'voltage': current,
                                  'current': current})
    red, = of_level('red', one, servo)
    assert 'times the inertia' in red.sentence and 'thousandths' in red.sentence


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


def gear_motor(ratio=50.0):
    """Return one encoder, command and current of a voltage drive, with noise; and its servo."""
    servo = load(CONFIG / 'servos' / 'geared_dc.yaml')
    values, period = servo.values, 1e-3
    time = np.arange(4000) * period
    speed = 60.0 * np.sin(3.0 * time) + 30.0 * np.sin(17.0 * time)
    angle = np.cumsum(speed) * period
    inertia = (values['mechanism.rotor_inertia']
               + values['mechanism.load_inertia'] / values['mechanism.ratio']**2)
    current = (inertia * np.gradient(speed, period) + 1e-3 * np.sign(speed)) / values[
        'drive.torque_constant']
    voltage = (values['drive.resistance'] * current + values['drive.back_emf'] * speed) / values[
        'drive.gain']
    nothing = np.full(len(time), np.nan)
    columns = {name: nothing for name in COLUMNS} | {
        'voltage': voltage, 'current': current, 'motor_position': angle}
    return Recording('motor', period, columns), servo


def test_it_sees_an_encoder_on_the_other_shaft_by_the_back_emf():
    one, servo = gear_motor()
    assert servo.drive.name == 'voltage_drive'
    assert not of_level('red', one, servo)
    wrong = changed(one, load_position=one['motor_position'],
                    motor_position=np.full(len(one), np.nan))
    red = of_level('red', wrong, servo)
    assert any('other shaft' in finding.sentence for finding in red), red


def test_a_slow_recording_does_not_outvote_the_one_that_shows_the_inertia(good):
    turned = changed(good, current=-good['current'], voltage=-good['voltage'])
    slow = replace(good, name='slow', columns={**good.columns, **{
        name: good[name][0] + 1e-3 * (good[name] - good[name][0])
        for name in ('motor_position', 'load_position')}})
    assert any(one.level == 'red' for one in check([turned, slow], BENCH))


def test_the_command_prints_findings_as_json_and_fails_where_one_is_red(good, tmp_path, capsys):
    write_recording(tmp_path / 'good', good)
    spoilt = changed(good, current=-good['current'])
    write_recording(tmp_path / 'spoilt', spoilt)
    assert main(['check', str(tmp_path / 'good'), '--servo', str(SERVO), '--json', '-']) == 0
    said = json.loads(capsys.readouterr().out)
    assert 'red' not in {one['level'] for one in said['findings']}
    assert {'path': 'controller.filter', 'value': 0.0, 'unit': 's'} in said['defaults']
    assert main(['check', str(tmp_path / 's*'), '--servo', str(SERVO)]) == 1
    said = capsys.readouterr()
    assert 'turn the sign' in said.out
    assert 'as the servo file does not give them: ' in said.err
    assert 'give those that differ' in said.err


def test_it_asks_whether_a_torque_was_computed_from_the_current(good):
    computed = changed(good, torque=3.3 * good['current'])
    said, = [one for one in check([computed], BENCH) if 'computed' in one.sentence]
    assert said.level == 'amber' and '3.3 N m/A times the current' in said.sentence
    assert not any('computed' in one.sentence for one in check([good], BENCH))


def test_it_says_once_what_is_so_of_several_recordings(good):
    several = [replace(good, name=f'run {k}', warnings=('there is no voltage',))
               for k in range(5)]
    said, = [one for one in check(several, BENCH) if 'no voltage' in one.sentence]
    assert said.sentence == 'run 0, run 1, run 2 and 2 more: there is no voltage'


def test_what_is_red_keeps_the_name_of_its_recording(good):
    still = [changed(replace(good, name=name), current=np.zeros(len(good))) for name in 'ab']
    red = [one for one in check([*still, good], BENCH) if one.level == 'red']
    assert [one.recording for one in red] == ['a', 'b']


def test_it_says_what_is_meant_by_repeats_and_what_to_do(good):
    found = check([replace(good, family='')] * 3, BENCH)
    unnamed, = [one for one in found if 'family' in one.sentence]
    assert 'cannot be told' in unnamed.sentence and '--family' in unnamed.action
    few = check([replace(good, family=name) for name in ('sine', 'sine', 'steps')], BENCH)
    said, = [one for one in few if 'No family has 3' in one.sentence]
    assert 'sine 2, steps 1' in said.sentence
    assert said.action == 'record one motion 3 times'


@pytest.mark.parametrize(('families', 'words'), [
    (('', '', '', ''), ('do not say which of them repeat', 'recordings.yaml')),
    (('sine', 'sine', 'steps', 'slow'), ('no motion was recorded 3 times', 'record one motion'))])
def test_a_diagnosis_says_why_it_holds_out_other_motions(good, families, words):
    told = split([replace(good, family=name) for name in families], [], []).warnings[-1]
    assert all(word in told for word in words)


def test_where_one_recording_shows_the_inertia_as_well_another_is_not_asked_for_it(good):
    heavy = BENCH.with_values({'mechanism.load_inertia': 10 * 5.76,
                               'mechanism.rotor_inertia': 1.14e-3})
    servo = replace(heavy, tolerance={})
    strong = replace(good, name='strong', columns={**good.columns, **{
        name: 10.0 * good[name] for name in ('current', 'voltage', 'torque')}})
    asked = [one for one in check([strong, good], servo) if 'times the inertia' in one.sentence]
    assert asked == [] and of_level('amber', good, servo)


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


def test_it_works_out_channels_and_references_once(good, monkeypatch):
    from servo_identify.data import looked_over

    asked, work = [], looked_over.off_references
    monkeypatch.setattr(looked_over, 'off_references',
                        lambda *given: asked.append(given) or work(*given))
    check([good], BENCH)
    assert len(asked) == 1


def test_sentences_that_differ_in_their_numbers_alone_are_one(good):
    several = [replace(good, name=f'run_{k}', warnings=(
        f'times are not even ({k}e-3 to 0.5 s apart): resampled to 0.001 s',)) for k in (1, 2)]
    found, = [one for one in check(several, BENCH) if 'not even' in one.sentence]
    assert found.sentence == ('run_1, run_2: times are not even (1e-3 to 0.5 s apart): resampled '
                              'to 0.001 s (the numbers are of run_1)')
