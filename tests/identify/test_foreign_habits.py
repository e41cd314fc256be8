"""Tables as other tools and other habits write them: an answer, or what to do about them."""

from init_bench import gear_motor, GIVEN, init, write
import numpy as np
import pytest

from servo_identify.cli import main
from servo_identify.data.column_names import split
from servo_identify.data.reading import read_recordings
from servo_identify.data.tables import read_table
from servo_identify.init.hints import phases
from servo_identify.init.joints import joints_of


@pytest.fixture(scope='module')
def run():
    return gear_motor()


def refused(data, folder, capsys, *more):
    """Return what init says that it needs."""
    assert main(['init', str(data), '-o', str(folder / 's.yaml'), *GIVEN, *more]) == 2
    return capsys.readouterr().err


def test_a_time_that_counts_the_rows_is_asked_for_and_not_taken_for_ms(run, tmp_path, capsys):
    rows = np.arange(len(run['time']), dtype=float)
    data = write(tmp_path / 'log.csv', {'time': rows, 'u [V]': run['u'], 'i [A]': run['i'],
                                        'q [rad]': run['q']})
    assert 'its numbers count the rows' in refused(data, tmp_path, capsys)
    assert init(data, tmp_path, '--column', 't=:2 ms') == 0
    (one,) = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert one.period == pytest.approx(0.002)


def test_what_has_a_unit_of_time_and_rises_is_the_time_whatever_its_name(run, tmp_path):
    data = write(tmp_path / 'scope.csv', {'Source [Second]': run['time'], 'u [V]': run['u'],
                                          'i [A]': run['i'], 'q [rad]': run['q']})
    assert init(data, tmp_path) == 0
    assert "source: 'Source [Second]'" in (tmp_path / 'new' / 'm.yaml').read_text()


def test_an_angle_in_volts_is_told_how_to_be_given(run, tmp_path, capsys):
    data = write(tmp_path / 'scope.csv', {'t [s]': run['time'], 'A [V]': run['u'],
                                          'current [A]': run['i'], 'C [V]': run['q'] / 0.3})
    assert "--column 'load_position=C [V]:0.3 rad'" in refused(data, tmp_path, capsys)
    assert init(data, tmp_path, '--column', 'load_position=C [V]:0.3 rad', '--column',
                'voltage=A [V]') == 0
    (one,) = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    np.testing.assert_allclose(one['load_position'], run['q'], atol=1e-6)


def test_a_speed_alone_is_told_to_be_integrated(run, tmp_path, capsys):
    data = write(tmp_path / 'log.csv', {'t [s]': run['time'], 'voltage [V]': run['u'],
                                        'current [A]': run['i'], 'speed [rad/s]': run['q']})
    assert 'cumulative_trapezoid' in refused(data, tmp_path, capsys)


@pytest.mark.parametrize('names', [('ia [A]', 'ib [A]', 'ic [A]'), ('u_u', 'u_v', 'u_w')])
def test_the_phases_of_a_motor_are_no_joints_and_none_of_them_its_current(names):
    (said,) = phases(['t', *names, 'theta', 'Channel A [V]', 'Channel B [V]', 'Channel C [V]'])
    assert said.startswith(', '.join(map(repr, names))) and 'i_q' in said


def test_letters_are_joints_where_angles_have_them_too():
    currents, volts = ['i_a', 'i_b', 'i_c'], ['u_a', 'u_b', 'u_c']
    assert joints_of([currents, volts, ['theta']], messages=False) == []
    assert joints_of([currents, ['pos_a', 'pos_b', 'pos_c']], messages=False) == ['a', 'b', 'c']


def test_a_torque_in_percent_is_given_as_what_one_percent_is(run, tmp_path, capsys):
    share = 100.0 * run['i'] / 5.0
    data = write(tmp_path / 'log.csv', {'t [s]': run['time'], 'torque_actual [%]': share,
                                        'voltage [V]': run['u'], 'motor_position [rad]':
                                        run['theta']})
    said = refused(data, tmp_path, capsys)
    assert "'current=torque_actual [%]:UNIT' of the motor" in said and ':%' not in said
    assert 'UNIT is what 1 % of that torque is, such as 0.0127 N m' in said
    assert init(data, tmp_path, '--column', 'current=torque_actual [%]:0.00225 N m') == 0
    (one,) = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    np.testing.assert_allclose(one['current'], run['i'], atol=1e-6)


def test_words_for_two_readings_or_two_shafts_are_no_joints():
    for names in (('raw', 'filt'), ('motor', 'load')):
        columns = [[f'{kind}_{name}' for name in names] for kind in ('temp', 'torque')]
        assert joints_of(columns, messages=False) == []


@pytest.mark.parametrize('first', [739373.5, 2460432.5])  # datenum of MATLAB, Julian date
def test_days_since_an_early_year_are_told_by_their_size(run, tmp_path, first):
    text = [f'{first + t / 86400.0:.11f},{u:.5f},{i:.5f},{q:.6f}' for t, u, i, q in zip(
        *(run[name] for name in ('time', 'u', 'i', 'q')), strict=True)]
    data = tmp_path / 'log.csv'
    data.write_text('\n'.join(['time,u [V],i [A],q [rad]', *text]))
    assert init(data, tmp_path) == 0
    (one,) = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert one.period == pytest.approx(0.002, rel=1e-3)


@pytest.mark.parametrize('labels', [('1', '2'), ('hip', 'knee')])
def test_rows_of_two_machines_in_turn_are_refused_with_what_to_do(run, tmp_path, labels):
    rows = [f'{t + 0.001 * k:.4f},{label},{u * (1 - 0.7 * k):.4f},{q * (1 - 0.7 * k):.6f}'
            for t, u, q in zip(*(run[one] for one in ('time', 'u', 'q')), strict=True)
            for k, label in enumerate(labels)]
    (tmp_path / 'bus.csv').write_text('\n'.join(['t,motor_id,voltage,load_position', *rows]))
    with pytest.raises(ValueError, match="'motor_id' tells apart .*groupby"):
        read_table(tmp_path / 'bus.csv')
    one = '\n'.join(row for row in rows if f',{labels[0]},' in row)
    (tmp_path / 'one.csv').write_text(f't,motor_id,voltage,load_position\n{one}')
    assert len(read_table(tmp_path / 'one.csv')['t']) == len(run['time'])


def test_a_bit_that_changes_with_each_row_is_no_machine(run, tmp_path):
    bit = np.arange(len(run['time'])) % 2
    data = write(tmp_path / 'log.csv', {'t': run['time'], 'toggle': bit, 'watchdog': 10 * bit,
                                        'noise': np.random.default_rng(0).normal(size=len(bit)),
                                        'voltage': run['u'], 'load_position': run['q']})
    assert len(read_table(data)['t']) == len(bit)


def test_the_counts_of_a_coarse_encoder_are_no_machines(tmp_path):
    time = 0.05 * np.arange(4000)
    data = write(tmp_path / 'log.csv', {
        't': time, 'motor_position': 50.0 * np.sin(3.0 * time),
        'load_position [1/64 rev]': np.round(16.0 * np.sin(3.0 * time))})
    assert len(read_table(data)['t']) == len(time)


def test_a_unit_behind_a_blank_belongs_to_its_name_where_blanks_part_the_columns(tmp_path):
    rows = ''.join(f'{0.1 * k:6.3f} {k}.5  {2 * k}.0\n' for k in range(9))
    (tmp_path / 'log.txt').write_text('t [s]   u [V]  torque [N m]\n' + rows)
    table = read_table(tmp_path / 'log.txt')
    assert [*table.columns] == ['t [s]', 'u [V]', 'torque [N m]']
    assert table['torque [N m]'][3] == 6.0


@pytest.mark.parametrize('head', ['"t" "u" "theta"', '       t    u   theta',
                                  '"t [s]" "u [V]" "theta [rad]"'])
def test_the_name_that_r_and_pandas_leave_out_is_that_of_the_first_column(tmp_path, head):
    rows = ''.join(f'{k} {0.1 * k:.3f} {k}.5 {2 * k}.0\n' for k in range(9))
    (tmp_path / 'log.txt').write_text(f'{head}\n{rows}')
    table = read_table(tmp_path / 'log.txt')
    found = {split(name)[0]: column[2] for name, column in table.columns.items()}
    assert (found['t'], found['u'], found['theta']) == (0.2, 2.5, 4.0)


@pytest.mark.parametrize('text', [
    '{"t": 0.0, "u": 1.5}\n{"t": 0.1, "u": 2.5}\n',
    '{"0": {"t": 0.0, "u": 1.5}, "1": {"t": 0.1, "u": 2.5}}'])
def test_json_may_hold_a_record_in_each_line_or_under_its_number(tmp_path, text):
    (tmp_path / 'log.json').write_text(text)
    table = read_table(tmp_path / 'log.json')
    assert table['t'].tolist() == [0.0, 0.1] and table['u'].tolist() == [1.5, 2.5]


@pytest.mark.parametrize(('name', 'text', 'words'), [
    ('log.csv', 't,u\n0,1F\n1,20\n2,A0\n', 'are these hexadecimal'),
    ('log.json', '[{"id": 1, "pos": [' + '0.125, ' * 99 + '1.0]}]', 'each cell holds a list')])
def test_a_column_of_no_numbers_is_shown_in_short_with_what_to_do(tmp_path, name, text, words):
    (tmp_path / name).write_text(text)
    table = read_table(tmp_path / name)
    (said,) = table.refused.values()
    assert words in said and len(said) < 400


@pytest.mark.parametrize(('name', 'text', 'words'), [
    ('echo.txt', 'header:\n  stamp:\n    sec: 17\nname:\n- elbow\nposition:\n- 0.25\n---\n' * 9,
     'is a print of messages, as `ros2 topic echo`'),
    ('gz.txt', 'joint {\n  name: "elbow"\n  axis1 {\n    position: 0.25\n  }\n}\n' * 9,
     'is a print of messages'),
    ('pcan.trc', '  1)  0.1  Rx 0181 4 00 11 22 33\n', 'decode them by the DBC')])
def test_logs_that_are_no_tables_are_refused_with_what_to_do(tmp_path, name, text, words):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=words):
        read_table(tmp_path / name)
