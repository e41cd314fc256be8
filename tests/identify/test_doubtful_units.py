"""Names that put a unit in doubt, and other habits of drives and databases, through init."""

import json

from init_bench import gear_motor, init, write
import numpy as np
import pytest
from test_foreign_habits import refused

from servo_identify.data.column_names import is_electrical, looks_like
from servo_identify.data.reading import read_recordings
from servo_identify.data.recording_check import check
from servo_identify.data.table_import import import_table
from servo_identify.data.tables import read_table
from servo_twin.description import servo_file
from servo_twin.recording.recording import Recording

PAIRS = 7


@pytest.fixture(scope='module')
def run():
    return gear_motor()


def read(data, folder):
    """Return the recording that both files of init make of the data."""
    (one,) = read_recordings([data], folder / 'new' / 's.yaml', folder / 'new' / 'm.yaml')
    return one


def test_an_effective_current_by_its_name_is_asked_for_though_its_unit_is_ampere(
        run, tmp_path, capsys):
    data = write(tmp_path / 'log.csv', {
        't [s]': run['time'], 'voltage [V]': run['u'], 'motor_current_rms [A]':
        run['i'] / np.sqrt(2.0), 'motor_position [rad]': run['theta']})
    assert 'N m/Arms' in refused(data, tmp_path, capsys)
    assert init(data, tmp_path, '--column', 'current=motor_current_rms [A]:1.41421356 A') == 0
    np.testing.assert_allclose(read(data, tmp_path)['current'], run['i'], atol=1e-6)


def test_a_table_in_capitals_is_in_milliamperes_which_init_says(run, tmp_path, capsys):
    data = write(tmp_path / 'log.csv', {
        'TIME (S)': run['time'], 'VOLTAGE (MV)': 1e3 * run['u'], 'CURRENT_MA': 1e3 * run['i'],
        'MOTOR POSITION (DEG)': np.degrees(run['theta']), 'SPEED (RPM)': run['theta']})
    assert init(data, tmp_path) == 0
    assert "'CURRENT_MA' in mA: capitals do not tell m from M" in capsys.readouterr().out
    seen = read(data, tmp_path)
    np.testing.assert_allclose(seen['current'], run['i'], atol=1e-6)
    np.testing.assert_allclose(seen['voltage'], run['u'], atol=1e-6)


def test_a_peak_current_is_told_what_it_is(run, tmp_path, capsys):
    data = write(tmp_path / 'log.csv', {
        't [s]': run['time'], 'voltage [V]': run['u'], 'current [Apk]': run['i'],
        'motor_position [rad]': run['theta']})
    assert '0.707107 A where it is given for the effective value' in refused(
        data, tmp_path, capsys)


@pytest.mark.parametrize('name, turn', [('theta_el [rad]', 2.0 * np.pi),
                                        ('motor_electrical_angle [deg]', 360.0)])
def test_an_electrical_angle_is_asked_for_its_pole_pairs_and_put_together(
        run, tmp_path, capsys, name, turn):
    slow = 0.1 * run['theta']  # the field turns by less than a third between two rows
    field = np.mod(PAIRS * slow * turn / (2.0 * np.pi), turn)
    data = write(tmp_path / 'log.csv', {'t [s]': run['time'], name: field})
    assert '1/7 rad at 7 pole pairs' in refused(data, tmp_path, capsys)
    unit = f'1/{PAIRS} {name[-4:-1]}'
    assert init(data, tmp_path, '--column', f'motor_position={name}:{unit}') == 0
    seen = read(data, tmp_path)['motor_position']
    np.testing.assert_allclose(seen - seen[0], slow - slow[0], atol=1e-6)


def test_an_elevation_is_no_electrical_angle():
    assert not any(map(is_electrical, ('el_pos', 'elevation', 'elbow_angle', 'theta_motor')))
    assert all(map(is_electrical, ('theta_e', 'phiEl', 'Winkel elektrisch', 'angle_elec [rad]')))


def test_angles_in_gon_are_known(run, tmp_path):
    data = write(tmp_path / 'log.csv', {
        't [s]': run['time'], 'voltage [V]': run['u'], 'current [A]': run['i'],
        'motor_angle_gon': run['theta'] * 200.0 / np.pi,
        'load_angle [gradians]': run['q'] * 200.0 / np.pi})
    assert init(data, tmp_path, '--mechanism', 'rigid') == 0
    np.testing.assert_allclose(read(data, tmp_path)['motor_position'], run['theta'], atol=1e-5)
    np.testing.assert_allclose(read(data, tmp_path)['load_position'], run['q'], atol=1e-6)


@pytest.mark.parametrize('name, column', [
    ('u_q', 'voltage'), ('vq', 'voltage'), ('uq_q15', 'voltage'), ('servo_control.q_V', 'voltage'),
    ('[ID:001]Goal PWM', 'voltage'), ('i_q', 'current'), ('_time', 't'), ('q', 'load_position')])
def test_the_q_beside_a_voltage_is_the_axis_of_a_motor(name, column):
    assert looks_like(name) == column


def test_a_number_of_each_row_is_offered_for_no_angle(run, tmp_path, capsys):
    data = write(tmp_path / 'trace.csv', {
        'Number': np.arange(len(run['time']), dtype=float), 't [s]': run['time'],
        'voltage [V]': run['u'], 'current [A]': run['i'], 'r61: speed [rpm]': run['q']})
    said = refused(data, tmp_path, capsys)
    assert "'Number'" not in said and 'cumulative_trapezoid' in said


def test_durations_with_their_unit_are_times(run, tmp_path):
    data = tmp_path / 'timetable.csv'
    rows = [f'{t:g} sec,{u},{i},{q}' for t, u, i, q in zip(
        run['time'], run['u'], run['i'], run['theta'], strict=True)]
    data.write_text('\n'.join(['Time,voltage,current,motor_position', *rows]))
    one = import_table(data, None)
    assert one.period == pytest.approx(0.002) and 'first row is of' not in one.note


def test_records_with_times_of_their_own_are_refused_in_short(run, tmp_path):
    several = [{'id': k, 't': run['time'].tolist(), 'motor_position': run['theta'].tolist()}
               for k in (1, 2)]
    data = tmp_path / 'motors.json'
    data.write_text(json.dumps(several))
    with pytest.raises(ValueError, match='2 records with times of their own.*json.dump') as said:
        import_table(data, None)
    assert len(str(said.value)) < 300
    data.write_text(json.dumps(several[:1]))
    assert len(import_table(data, None)['motor_position']) == len(run['time'])


def test_a_recording_in_thousandths_is_asked_for_though_all_of_it_fits_together(run, tmp_path):
    machine = servo_file.load('docs/example/fan.yaml')
    milli = {'voltage': 1e3 * run['u'], 'current': 4e4 * run['i'], 'motor_position':
             1e3 * run['theta']}
    found = check([Recording('a', 0.002, milli)], machine)
    said = ' '.join(one.sentence for one in found)
    assert 'and no servo has more than 2000 V: is it in mV?' in said
    assert 'and no servo has more than 5000 A: is it in mA?' in said


def test_texts_of_lists_are_called_lists(tmp_path):
    (tmp_path / 'log.csv').write_text('t;position\n0;(0.1, 0.2)\n1;(0.1, 0.3)\n')
    said = read_table(tmp_path / 'log.csv').refused['position']
    assert "'(0.1, 0.2)' in row 1" in said and 'each cell holds a list' in said


def test_stamps_of_net_are_told_by_their_size(run, tmp_path):
    text = [f'{638789724000000000 + round(1e7 * t)},{u:.5f},{i:.5f},{q:.6f}' for t, u, i, q in zip(
        *(run[name] for name in ('time', 'u', 'i', 'q')), strict=True)]
    data = tmp_path / 'log.csv'
    data.write_text('\n'.join(['timestamp,u [V],i [A],q [rad]', *text]))
    assert init(data, tmp_path) == 0
    one = read(data, tmp_path)
    assert one.period == pytest.approx(0.002) and '2025-03-30' in one.note


def test_a_red_finding_says_that_the_size_of_the_times_alone_told_their_unit(
        run, tmp_path, capsys):
    data = write(tmp_path / 'log.csv', {'t': np.round(1e7 * run['time']), 'u [V]': run['u'],
                                        'i [A]': run['i'], 'q [rad]': run['q']})
    assert init(data, tmp_path) == 1
    assert "taken in us by its size alone: --column 't=t:0.1 us'" in capsys.readouterr().err
    assert init(data, tmp_path, '--column', 't=t:0.1 us') == 0
    assert read(data, tmp_path).period == pytest.approx(0.002)
