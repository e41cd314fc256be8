"""In which unit a column of a table is, and where its counter wraps around: init ..."""


from init_bench import COUNT, gear_motor, init, write
import numpy as np
import pytest

from servo_identify.data.reading import read_recordings


@pytest.fixture(scope='module')
def run():
    return gear_motor()


def test_an_encoder_that_wraps_around_is_put_together_and_what_is_left_out_is_said(
        run, tmp_path, capsys):
    angle = np.degrees(run['theta'])
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'voltage': run['u'], 'current': run['i'],
        'motor_position [deg]': (angle + 180.0) % 360.0 - 180.0, 'speed [rpm]': run['q']})
    assert init(data, tmp_path) == 0
    said = capsys.readouterr().out
    assert 'wraps around at each 360 of them' in said and "left out             'speed" in said
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert np.allclose(one['motor_position'], run['theta'], atol=1e-6)


def test_a_counter_that_wraps_around_is_put_together(run, tmp_path, capsys):
    counts = np.round(run['theta'] / COUNT)
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'voltage': run['u'], 'current': run['i'],
        'counter': (counts + 16384) % 32768 - 16384})
    assert init(data, tmp_path, '--column', 'motor_position=counter:1/4096 rev') == 0
    assert 'wraps around at each 32768 of them' in capsys.readouterr().out
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert np.allclose(one['motor_position'], run['theta'], atol=1e-6)


@pytest.mark.parametrize('mark', ['_', '/', ', '])
def test_a_unit_may_be_the_last_word_of_a_name(run, tmp_path, mark):
    data = write(tmp_path / 'run.csv', {name.replace(' ', mark): column for name, column in {
        'time ms': 1e3 * run['time'], 'supply V': 24.0 + 0.0 * run['u'], 'command V': run['u'],
        'current mA': 1e3 * run['i'], 'motor_position deg': np.degrees(run['theta'])}.items()},
        ';')
    assert init(data, tmp_path) == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert one.period == pytest.approx(0.002)
    np.testing.assert_allclose(one['current'], run['i'], atol=1e-8)
    np.testing.assert_allclose(one['motor_position'], run['theta'], atol=1e-6)


def test_degrees_that_were_called_radians_are_found_out_and_nothing_is_written(
        run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {name: run[name] for name in ('time', 'u', 'i')} | {
        'theta': np.degrees(run['theta'])})
    assert init(data, tmp_path, '--column', 'motor_position=theta:rad', '--si') == 1
    assert 'degrees' in capsys.readouterr().out
    assert not (tmp_path / 'new').exists()


def test_a_count_of_the_vendor_is_a_unit_too(run, tmp_path):
    data = write(tmp_path / 'run.csv', {
        'time': run['time'], 'voltage': run['u'], 'motor_position': run['theta'],
        'current': np.round(run['i'] / 0.00269)})
    assert init(data, tmp_path, '--column', 'current=current:2.69 mA') == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert np.allclose(one['current'], run['i'], atol=0.0014)


@pytest.mark.parametrize('name', ['actual_q_0', 'q_0'])
def test_a_name_that_ends_with_the_number_of_a_joint_has_no_unit_there(run, tmp_path, name):
    data = write(tmp_path / 'run.csv', {'time': run['time'], 'voltage': run['u'],
                                        'current': run['i'], name: run['theta']})
    assert init(data, tmp_path, '--column', f'motor_position={name}:rad') == 0


def test_a_unit_may_be_the_word_that_says_the_quantity(run, tmp_path):
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'voltage': run['u'], 'current': run['i'], 'motor_position': run['theta'],
        'rpm': run['q'], 'rpm_set': np.gradient(run['q'], run['time']) * 30.0 / np.pi})
    assert init(data, tmp_path) == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    np.testing.assert_allclose(one['reference_velocity'], np.gradient(run['q'], run['time']))


def test_registers_that_were_read_as_unsigned_get_their_steps(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'voltage': run['u'], 'motor_position': run['theta'],
        'Present Current': np.round(run['i'] / 0.00269) % 65536})
    assert init(data, tmp_path, '--column', 'current=Present Current:2.69 mA') == 0
    assert 'in 2.69 mA, read as unsigned of 16 bit' in capsys.readouterr().out
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    np.testing.assert_allclose(one['current'], run['i'], atol=0.0014)


def test_the_unit_behind_a_name_is_that_of_a_column_that_is_given(run, tmp_path, capsys):
    data = write(tmp_path / 'run.csv', {'tout': run['time'], 'u': run['u'], 'i': run['i'],
                                        'theta_deg': np.degrees(run['theta'])})
    assert init(data, tmp_path, '--si', '--column', 'motor_position=theta_deg') == 0
    assert "motor_position       is 'theta_deg' in deg" in capsys.readouterr().out


@pytest.mark.parametrize(('name', 'first', 'unit'), [('micros', 2**32 - 2_000_000, 'us'),
                                                     ('ms', 2**16 - 1000, 'ms'),
                                                     ('TICK (MS)', 2**15 - 500, 'MS')])
def test_a_counter_of_time_that_begins_again_is_put_together(run, tmp_path, name, first, unit):
    counts = np.round(run['time'] / {'us': 1e-6}.get(unit, 1e-3)) + first
    data = write(tmp_path / 'run.csv', {
        name: counts % 2**np.ceil(np.log2(first)), 'voltage': run['u'],
        'current': run['i'], 'motor_position': run['theta']})
    assert init(data, tmp_path, '--column', f't={name}:{unit}') == 0
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert one.period == pytest.approx(0.002, rel=1e-3)
    assert len(one.time) == pytest.approx(2000, abs=3)
