"""Which column of a table is which, and in which unit: init ..."""

import json

from init_bench import COUNT, gear_motor, init, write
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.column_names import ANGLE, looks_like, TOLD_TORQUE, TORQUE
from servo_identify.data.reading import read_recordings
from servo_twin.description.servo_file import load


@pytest.fixture(scope='module')
def run():
    return gear_motor()


@pytest.mark.parametrize('how', ['plain', 'bare', 'german', 'milliseconds and degrees', 'json'])
def test_both_files_pass_the_check_for_awkward_tables(run, tmp_path, how, capsys):
    columns = {name: run[name] for name in ('time', 'u', 'i', 'theta')}
    more = ['--column', 'motor_position=theta:rad']
    data = tmp_path / 'run.csv'
    if how == 'bare':
        write(data, columns, names=False)
        more = ['--column', 't=column_1', '--column', 'voltage=column_2', '--column',
                'current=column_3', '--column', 'motor_position=column_4:rad']
    elif how == 'german':
        write(data, dict(zip(('Zeit', 'Spannung', 'Strom', 'Winkel'), columns.values(),
                             strict=True)), ';', ',')
        more = ['--column', 'motor_position=Winkel:rad']
    elif how == 'json':
        data = tmp_path / 'run.json'
        data.write_text(json.dumps({'name': 'x', 'entries': [
            dict(zip(columns, row, strict=True))
            for row in np.array(list(columns.values())).T.tolist()]}))
    elif how == 'plain':
        write(data, columns)
    else:
        write(data, {**columns, 'time': 1e3 * run['time'], 'theta': np.degrees(run['theta'])})
        more = ['--column', 'motor_position=theta:deg']
    assert init(data, tmp_path, '--si', *more) == 0
    servo, mapping = tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml'
    assert main(['check', str(data), '--servo', str(servo), '--mapping', str(mapping)]) == 0
    made = load(servo)
    assert made.values['drive.resistance'] == pytest.approx(2.1)
    assert made.values['drive.back_emf'] == pytest.approx(30 / np.pi / 212, rel=1e-5)
    assert made.values['mechanism.rotor_inertia'] == pytest.approx(3.2e-5)
    one, = read_recordings([data], servo, mapping)
    assert one.period == pytest.approx(0.002)
    assert np.allclose(one['motor_position'], run['theta'], atol=1e-6)
    assert 'given as 212 rpm/V' in servo.read_text() and '# effects:' in servo.read_text()


def test_it_names_time_and_encoder_of_a_table_without_names_at_once(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'theta')},
                 names=False)
    assert init(data, tmp_path) == 2
    said = capsys.readouterr().err
    assert '--column t=SOURCE' in said and '--column motor_position=SOURCE' in said


def test_a_table_of_a_german_logger_needs_no_column_named_but_the_shaft(tmp_path, run, capsys):
    folder = tmp_path / 'Läufe im Mai'
    folder.mkdir()
    table = {'Zeit [s]': run['time'], 'Lastwinkel [deg]': np.degrees(run['q']),
             'Strom [mA]': 1e3 * run['i'], 'Sollstrom [mA]': 1e3 * run['i']}
    for number in (1, 2):
        write(folder / f'sinus_{number}.csv', table, ';', ',')
    servo = tmp_path / 's.yaml'
    assert main(['init', str(folder / 'sinus_1.csv'), '-o', str(servo), '--drive', 'current',
                 '--gain', '1 A/A', '--torque-constant', '45 mN m/A', '--rotor-inertia',
                 '320 g cm2', '--load-inertia', '120 kg cm2', '--ratio', '50',
                 '--no-questions']) == 0
    assert "Läufe im Mai/*.csv'" in capsys.readouterr().out.splitlines()[-1]
    two = read_recordings([folder / '*.csv'], servo, tmp_path / 's_columns.yaml')
    assert len(two) == 2
    np.testing.assert_allclose(two[0]['voltage'], run['i'], atol=1e-8)
    np.testing.assert_allclose(two[0]['load_position'], run['q'], atol=1e-8)


@pytest.mark.parametrize(('beside', 'named'), [('2,1,0,1\n3,1,0,1\n', '*.txt'),
                                               ('', 'run.txt'), ('Notes of May', 'run.txt')])
def test_it_names_next_all_tables_that_are_like_one_without_names(
        run, tmp_path, capsys, beside, named):
    columns = {name: run[name] for name in ('time', 'u', 'i', 'theta')}
    data = write(tmp_path / 'run.txt', columns, names=False)
    (tmp_path / 'beside.txt').write_text(beside)
    more = [word for k, name in enumerate(('t', 'voltage', 'current', 'motor_position'), 1)
            for word in ('--column', f'{name}=column_{k}')]
    assert init(data, tmp_path, '--si', *more) == 0
    assert f'{tmp_path.name}/{named}' in capsys.readouterr().out.splitlines()[-1]


def test_the_set_point_is_not_the_command_of_an_amplifier_with_another_gain(tmp_path, run, capsys):
    data = write(tmp_path / 'run.csv', {'t': run['time'], 'load_position': run['q'],
                                        'current': run['i'], 'current_reference': run['i']})
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--drive', 'current',
                 '--gain', '0.5 A/V', '--torque-constant', '45 mN m/A', '--rotor-inertia',
                 '320 g cm2', '--load-inertia', '120 kg cm2', '--ratio', '50',
                 '--no-questions']) == 0
    assert 'there is no voltage' in capsys.readouterr().out


def test_the_scope_of_a_drive_has_its_reference_at_the_motor(run, tmp_path, capsys):
    counts = np.round(run['theta'] / COUNT)
    data = write(tmp_path / 'scope.csv', {
        'Time (ms)': 1e3 * run['time'], 'Actual Motor Position (counts)': counts,
        'Commanded Position (counts)': counts + 2.0, 'Actual Current (A)': run['i'],
        'Voltage Command (V)': run['u']})
    motor = ['--column', 'motor_position=Actual Motor Position (counts):1/4096 rev', '--column']
    assert init(data, tmp_path, *motor[:2]) == 2
    assert 'or --column reference_position= without it' in capsys.readouterr().err
    given = 'reference_position=Commanded Position (counts):1/{} rev'
    assert init(data, tmp_path, *motor, given.format(4096)) == 2
    assert f'1/4096 rev becomes 1/{4096 * 50} rev' in capsys.readouterr().err
    assert init(data, tmp_path, *motor, given.format(4096 * 50)) == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert np.allclose(one['reference_position'], run['theta'] / 50.0, atol=1e-3)
    capsys.readouterr()
    assert init(data, tmp_path, *motor, 'reference_position=', '--force') == 0
    assert "left out             'Commanded Position (counts)'" in capsys.readouterr().out
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert not one.has('reference_position')


@pytest.mark.parametrize(('name', 'column'), [
    ('out.logsout.theta.Time', 't'), ('out.logsout.theta.Data', ANGLE),
    ('angle.time', 't'), ('out.logsout.i.Time', 't')])
def test_the_times_of_a_signal_are_no_angle(name, column):
    assert looks_like(name) == column


@pytest.mark.parametrize(('name', 'column'), [
    ('Winkel', ANGLE), ('Lage', ANGLE), ('Istposition', ANGLE), ('Lageistwert', ANGLE),
    ('Motorwinkel', 'motor_position'), ('Abtriebswinkel', 'load_position'),
    ('Sollposition', 'reference_position'), ('Lagesollwert', 'reference_position'),
    ('Drehzahlsollwert', 'reference_velocity'), ('Strom', 'current'), ('Spannung', 'voltage'),
    ('Stromsollwert', 'current_reference'), ('Drehmoment', 'torque'), ('Zeitstempel', 't'),
    ('Gehäusetemperatur', 'temperature'), ('Drehzahl', ''), ('Solldrehmoment', TOLD_TORQUE),
    ('Istdrehmoment', TORQUE), ('tau_est', TORQUE), ('effort', TORQUE), ('tau_sensor', 'torque'),
    ('Zwischenkreisspannung', ''), ('Schleppfehler', ''), ('Positionsabweichung', '')])
def test_it_knows_the_names_of_german_loggers(name, column):
    assert looks_like(name) == column


def test_what_begins_with_t_and_does_not_rise_is_a_temperature(run, tmp_path, capsys):
    warm = 20.0 + 3.0 * np.sin(run['time'])
    columns = {'t_s': run['time'], 'T_housing_C': warm, 'T_case': warm + 1.0, 'voltage': run['u'],
               'current': run['i'], 'motor_position': run['theta']}
    data = write(tmp_path / 'run.csv', columns)
    assert init(data, tmp_path) == 0
    assert "left out             'T_case'" in capsys.readouterr().out
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    np.testing.assert_allclose(one['temperature'], warm, rtol=1e-8)
    assert one.period == pytest.approx(0.002)


def test_a_column_of_text_is_named_apart_from_the_question_for_another(run, tmp_path, capsys):
    data = tmp_path / 'run.csv'
    data.write_text('t,voltage,state,level\n' + ''.join(
        f'{t:.4f},{u:.6f},RUN,{u:.6f}\n' for t, u in zip(run['time'], run['u'], strict=True)))
    assert init(data, tmp_path) == 2
    said = capsys.readouterr().err
    question, apart = said.split('\n  left out: ')
    assert "motor_position=SOURCE:UNIT (of ['level'])" in question
    assert 'RUN' not in question and "column 'state' has 'RUN' in row 1" in apart


@pytest.mark.parametrize(('name', 'column'), [
    ('qpos[0]', 'load_position'), ('qvel[0]', ''), ('ctrl[0]', 'voltage')])
def test_it_knows_the_names_of_a_rollout_of_mujoco(name, column):
    assert looks_like(name) == column


def test_a_rollout_with_one_state_more_is_told_what_to_cut(run, tmp_path, capsys):
    data = tmp_path / 'rollout.npz'
    np.savez(data, time=run['time'], qpos=np.append(run['q'], 0.0)[:, None],
             ctrl=run['u'][:, None], batch=np.zeros((2, 9, 3)))
    assert init(data, tmp_path, '--si') == 2
    said = capsys.readouterr().err
    assert "'time' has 2000 rows and 'qpos[0]' 2001: cut them to the same length" in said
    assert "'batch' has the shape (2, 9, 3): save one run" in said
    np.savez(data, time=run['time'], qpos=50.0 * run['q'][:, None], ctrl=run['u'][:, None])
    assert init(data, tmp_path, '--si', '--column', 'motor_position=qpos[0]') == 0


@pytest.mark.parametrize(('name', 'column'), [
    ('AZ_deg', ANGLE), ('AZ_cmd_deg', 'reference_position'), ('AZ_rate_cmd', 'reference_velocity'),
    ('UTC_s', 't'), ('wheel_rate', ''), ('case_temp_deg', 'temperature')])
def test_it_knows_an_angle_by_its_unit_and_a_speed_by_the_word_rate(name, column):
    assert looks_like(name) == column


@pytest.mark.parametrize('name', ['duty', 'pwm_out', 'duty_cycle'])
def test_a_share_of_the_supply_is_asked_for_and_never_taken_for_volts(tmp_path, capsys, name):
    motor = gear_motor()
    data = write(tmp_path / 'a.csv', {'t': motor['time'], name: motor['u'] / 24.0,
                                      'motor_position': motor['theta']})
    assert init(data, tmp_path, '--si') == 2
    assert 'it is a share of the supply: give what 1 of it is, 24 V' in capsys.readouterr().err
    assert init(data, tmp_path, '--si', '--column', f'voltage={name}:24 V') == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert one['voltage'] == pytest.approx(motor['u'], abs=1e-6)


def test_it_asks_of_a_channel_in_volts_whether_it_is_the_command(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {'time': run['time'], 'CH1(V)': run['u'],
                                        'CH2(A)': run['i'], 'motor_position': run['theta']})
    assert init(data, tmp_path) == 2
    said = capsys.readouterr().err
    assert "--column 'voltage=CH1(V)' where that is the command" in said
    assert init(data, tmp_path, '--column', 'voltage=') == 0
    assert init(data, tmp_path, '--column', 'voltage=CH1(V)', '--force') == 0
    assert "voltage              is 'CH1(V)' in V" in capsys.readouterr().out


def test_it_offers_neither_speeds_nor_counts_nor_what_stands_still_for_an_angle(
        run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {
        'time': run['time'], 'voltage': run['u'], 'omega': run['u'], 'state': 0.0 * run['u'],
        'frame': run['time'], 'x7': run['q']})
    assert init(data, tmp_path) == 2
    assert "motor_position=SOURCE:UNIT (of ['x7'])" in capsys.readouterr().err


@pytest.mark.parametrize(('name', 'column'), [
    ('i1_A', 'current'), ('q2', ANGLE), ('u1', 'voltage'), ('th1_rad', ANGLE),
    ('current2', 'current'), ('qd1', ''), ('t1', '')])
def test_the_number_of_a_joint_may_follow_a_symbol(name, column):
    assert looks_like(name) == column


def test_it_asks_for_the_joint_of_symbols_with_numbers(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'u1': run['u'], 'u2': run['u'], 'i1': run['i'], 'i2': run['i'],
        'theta1': run['theta'], 'theta2': run['theta']})
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions']) == 2
    assert "--joint NAME (of ['1', '2']" in capsys.readouterr().err


def test_an_angle_of_the_other_shaft_is_not_left_out_without_a_word(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'u': run['u'], 'i': run['i'], 'theta': run['theta'],
        'theta_load': run['theta'] / 50})
    said = ("'theta' is an angle as well: --column 'motor_position=theta:UNIT' where it is that "
            'of the motor')
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions']) == 2
    assert said in capsys.readouterr().err
    init(data, tmp_path, '--si', '--ratio', '1')
    assert said in capsys.readouterr().out


def test_a_share_of_the_supply_in_percent_is_asked_for_its_volts_or_left_out(
        run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'pwm [%]': 100.0 * run['u'] / 24.0, 'current [A]': run['i'],
        'motor_position [rad]': run['theta']})
    assert main(['init', str(data), '-o', str(tmp_path / 's.yaml'), '--no-questions']) == 2
    assert ('give what 1 of it is, 0.24 V of a % at 24 V), or --column voltage= without it'
            in capsys.readouterr().err)
    assert init(data, tmp_path, '--column', 'voltage=pwm [%]:0.24 V') == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert one['voltage'] == pytest.approx(run['u'], abs=1e-3)
