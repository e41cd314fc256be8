"""Exports of programs and instruments as they are: names, units, numbers and times."""

from init_bench import gear_motor, GIVEN, write
import numpy as np
import pyarrow
from pyarrow import parquet
import pytest

from servo_identify.cli import main
from servo_identify.commands import init as command
from servo_identify.data.column_names import ANGLE, looks_like, TOLD_TORQUE
from servo_identify.data.column_units import factor_of
from servo_identify.data.reading import read_recordings
from servo_identify.data.tables import read_table
from servo_identify.init.sources import offered


def init(data, *more):
    return main(['init', str(data), '-o', str(data.parent / 's.yaml'), *GIVEN, '--force', *more])


def init_asking(data):
    given = [one for one in GIVEN if one != '--no-questions']
    return main(['init', str(data), '-o', str(data.parent / 's.yaml'), *given])


def read(data):
    mapping = data.parent / 's_columns.yaml'
    one, = read_recordings([data], data.parent / 's.yaml', mapping if mapping.exists() else None)
    return one


def shown(value, group, decimal):
    return f'{value:,.3f}'.translate(str.maketrans({',': group, '.': decimal}))


@pytest.mark.parametrize(('group', 'decimal', 'delimiter'), [
    ('.', ',', ';'), (',', '.', ';'), ("'", '.', ','),
    ('\N{RIGHT SINGLE QUOTATION MARK}', ',', ';')])
def test_numbers_with_signs_between_thousands_are_read_where_one_says_which_is_which(
        tmp_path, group, decimal, delimiter):
    run = gear_motor()
    wanted = {'Time [ms]': 1e3 * run['time'], 'Voltage [V]': run['u'],
              'Current [mA]': 1e3 * run['i'], 'Motor angle [deg]': np.degrees(run['theta'])}
    data = tmp_path / 'run.csv'
    data.write_text(delimiter.join(wanted) + '\n' + ''.join(
        delimiter.join(shown(value, group, decimal) for value in row) + '\n'
        for row in zip(*wanted.values(), strict=True)), 'utf8')
    assert init(data) == 0
    one = read(data)
    assert one.period == pytest.approx(0.002)
    np.testing.assert_allclose(one['motor_position'], run['theta'], atol=1e-5)


def test_a_sign_that_may_be_either_is_still_refused(tmp_path):
    data = tmp_path / 'run.csv'
    data.write_text("t;u\n0;1'016\n1;1'017\n")
    assert 'write no sign between thousands' in read_table(data).refused['u']


def test_names_far_above_the_numbers_behind_a_key_are_found_with_the_units(tmp_path):
    run = gear_motor()
    rows = zip(run['time'], run['u'], run['i'], run['theta'], strict=True)
    data = tmp_path / 'bench.csv'
    data.write_text('name,BenchRun\nuser,lab\npath,,"Model/u","Model/i","Model/theta"\n'
                    'unit,s,V,A,rad\nvariable,,U,I,theta_m\nvalues,,,,\n' + ''.join(
                        ',' + ','.join(f'{value:.6f}' for value in row) + '\n' for row in rows))
    assert init(data) == 0
    one = read(data)
    np.testing.assert_allclose(one['motor_position'], run['theta'], atol=1e-6)
    np.testing.assert_allclose(one['current'], run['i'], atol=1e-6)
    assert one.period == pytest.approx(0.002)


@pytest.mark.parametrize(('name', 'column'), [
    ('PL.FB(counts)', ANGLE), ('PL.CMD(counts)', 'reference_position'), ('IL.FB(Arms)', 'current'),
    ('IL.CMD(A)', 'current_reference'), ('VL.FB(rpm)', ''), ('VL.CMD(rpm)', 'reference_velocity'),
    ('CMD [V]', 'voltage'), ('Status', ''), ('field.position0', ANGLE), ('field.velocity12', ''),
    ('ts', 't'), ('Torque (counts)', 'torque'), ('q_d_1', 'reference_position'), ('q_1', ANGLE),
    ('dq_d_1', 'reference_velocity'), ('tau_J_d_1', TOLD_TORQUE), ('d_axis_current', 'current'),
    ('r62: n_soll [1/min]', 'reference_velocity'), ('r63: n_ist [1/min]', '')])
def test_a_unit_says_the_quantity_where_a_name_does_not(name, column):
    assert looks_like(name) == column


def test_an_effective_current_is_told_from_its_amplitude():
    with pytest.raises(ValueError, match=r'effective value.*N m/Arms.*else 1.41421 A'):
        factor_of('x', 'current', 'Arms', None)


def test_the_index_of_a_frame_without_a_name_is_the_time_where_it_holds_durations(tmp_path):
    run = gear_motor()
    nanoseconds = np.round(1e9 * run['time']).astype('timedelta64[ns]')
    data = tmp_path / 'run.parquet'
    parquet.write_table(pyarrow.table({
        'voltage': run['u'], 'current': run['i'], 'motor_position': run['theta'],
        '__index_level_0__': pyarrow.array(nanoseconds)}), data)
    assert init(data) == 0
    assert read(data).period == pytest.approx(0.002)


def test_two_times_that_go_on_alike_are_one(tmp_path):
    run = gear_motor()
    stamp = 1795701792000000000 + np.round(1e9 * run['time']).astype(np.int64)
    data = tmp_path / 'echo.csv'
    data.write_text('%time,field.header.stamp,field.position0,field.data\n' + ''.join(
        f'{at},{at},{angle:.6f},{u:.6f}\n' for at, angle, u in zip(
            stamp, run['theta'], run['u'], strict=True)))
    assert init(data, '--column', 'motor_position=field.position0:rad', '--column',
                'voltage=field.data:V') == 0
    np.testing.assert_allclose(read(data)['motor_position'], run['theta'], atol=1e-6)


def test_it_names_all_angles_where_two_columns_have_one_name(tmp_path, capsys):
    run = gear_motor()
    names = ('time', 'voltage', 'position', 'other')
    data = write(tmp_path / 'run.csv', dict(zip(names, (
        run['time'], run['u'], run['theta'], run['q']), strict=True)))
    data.write_text(data.read_text().replace('other', 'position', 1))
    assert init(data, '--si') == 2
    assert "or load_position; or of ['position (2)']" in capsys.readouterr().err


def test_the_label_of_a_signal_of_simulink_may_hold_the_unit(tmp_path):
    from scipy.io import savemat

    run = gear_motor()
    labels = {'command_V': run['u'], 'current_mA': 1e3 * run['i'],
              'motor_deg': np.degrees(run['theta'])}
    data = tmp_path / 'scope.mat'
    savemat(data, {'log': {'time': run['time'], 'signals': [
        {'values': values, 'label': label} for label, values in labels.items()]}})
    assert init(data, '--column', 'motor_position=log.signals[motor_deg].values:deg') == 0
    np.testing.assert_allclose(read(data)['current'], run['i'], atol=1e-9)


def test_of_lines_that_tell_all_columns_apart_that_with_units_holds_the_names(tmp_path):
    run = gear_motor()
    rows = '\n'.join(f'{t:.4f}\t{u:.5f}\t{i:.5f}\t{angle:.6f}' for t, u, i, angle in zip(
        run['time'], run['u'], run['i'], run['theta'], strict=True))
    data = tmp_path / 'bench.txt'
    data.write_text('Bench 7\n\nZeit [s]\tSpannung [V]\tStrom [A]\tMotorwinkel [rad]\n'
                    f'Intern\tMX840 CH1\tMX840 CH2\tMX460 CH1\n{rows}\n')
    assert init(data) == 0
    np.testing.assert_allclose(read(data)['motor_position'], run['theta'], atol=1e-6)


def test_the_exponents_of_fortran_are_read(tmp_path):
    data = tmp_path / 'run.dat'
    data.write_text('t u\n' + ''.join(
        f'{k * 2e-3:12.5E} {-1.5e-3 * k:12.5E}\n'.replace('E', 'D') for k in range(60)))
    np.testing.assert_allclose(read_table(data)['u'], -1.5e-3 * np.arange(60))


def test_it_offers_only_what_rises_for_the_time(tmp_path, capsys):
    run = gear_motor()
    data = write(tmp_path / 'run.csv', {'ms_today': 1e3 * run['time'], 'voltage': run['u'],
                                        'current': run['i'], 'motor_position': run['theta']})
    assert init(data) == 2
    assert "--column t=SOURCE:UNIT (of ['ms_today'];" in capsys.readouterr().err


def test_it_says_what_to_cut_of_the_stamps_of_a_serial_monitor(tmp_path):
    data = tmp_path / 'run.txt'
    data.write_text(''.join(f'14:03:{12 + k:06.3f} -> {k},1.5,2.5\n' for k in range(9)))
    assert "cut all up to ' -> ' off" in ' '.join(
        read_table(data, names=('t', 'u', 'q')).refused.values())


def test_columns_that_are_sampled_less_often_are_joined(tmp_path, capsys):
    run = gear_motor()
    rare = {'voltage': (run['u'], 5), 'current': (run['i'], 2)}
    columns = {name: np.where(np.arange(len(values)) % every, np.nan, values)
               for name, (values, every) in rare.items()}
    data = write(tmp_path / 'run.csv', {'t': run['time'], **columns,
                                        'motor_position': run['theta']})
    assert init(data) == 0
    assert 'joined               voltage, current: sampled less often' in capsys.readouterr().out
    one = read(data)
    assert np.isfinite(one['current'][:-1]).all() and np.isfinite(one['voltage']).all()
    assert np.array_equal(one['voltage'][:5], np.full(5, one['voltage'][0]))
    np.testing.assert_allclose(one['current'][1], run['i'][[0, 2]].mean(), atol=1e-6)


def test_a_column_that_begins_late_is_not_joined(tmp_path, capsys):
    run = gear_motor()
    late = np.where(run['time'] < 2.0, np.nan, run['i'])
    data = write(tmp_path / 'run.csv', {'t': run['time'], 'voltage': run['u'], 'current': late,
                                        'motor_position': run['theta']})
    assert init(data) == 0
    assert 'joined' not in capsys.readouterr().out
    assert np.isnan(read(data)['current'][:900]).all()


def test_cells_of_lists_and_records_are_columns_of_their_parts(tmp_path):
    run = gear_motor()
    pairs = np.stack([run['q'], run['theta']], 1)
    data = tmp_path / 'episode.parquet'
    parquet.write_table(pyarrow.table({
        'timestamp': run['time'], 'action': pyarrow.array(run['u'][:, None].tolist()),
        'observation.state': pyarrow.FixedSizeListArray.from_arrays(
            pyarrow.array(pairs.ravel()), 2),
        'drive': pyarrow.array([{'current': one} for one in run['i'].tolist()])}), data)
    assert init(data, '--si', '--column', 'voltage=action[0]', '--column',
                'motor_position=observation.state[1]') == 0
    one = read(data)
    np.testing.assert_allclose(one['motor_position'], run['theta'])
    np.testing.assert_allclose(one['current'], run['i'])
    lines = tmp_path / 'log.jsonl'
    lines.write_text('{"t": 0, "q": [1, {"raw": 2}]}\n{"t": 1, "q": [3]}\n')
    found = read_table(lines)
    assert list(found['q[0]']) == [1.0, 3.0]
    assert np.array_equal(found['q[1].raw'], [2.0, np.nan], equal_nan=True)


def test_a_cell_of_a_picture_is_no_columns(tmp_path):
    data = tmp_path / 'a.jsonl'
    data.write_text('{"t": 0, "picture": [' + ', '.join('1' * 99) + ']}\n')
    assert 'picture' in read_table(data).refused


def test_it_asks_for_the_shaft_and_the_unit_of_an_angle_at_once(tmp_path, capsys):
    run = gear_motor()
    data = write(tmp_path / 'run.csv', {'t': run['time'], 'voltage': run['u'],
                                        'Position [cnt]': run['theta'] * 4096})
    assert init(data) == 2
    assert "--column 'motor_position=Position [cnt]:UNIT' (or load_position)" in (
        capsys.readouterr().err)


def test_on_a_terminal_counts_have_no_unit_that_enter_stands_for(tmp_path, monkeypatch):
    run = gear_motor()
    data = write(tmp_path / 'run.csv', {
        't': run['time'], 'voltage': run['u'], 'current': run['i'],
        'motor position (counts)': np.round(run['theta'] * 4096 / (2.0 * np.pi))})
    asked, answers = list[tuple[str, str]](), iter(['', '1/4096', '1/4096 rev'])

    def answered(question, default):
        asked.append((question, default))
        return next(answers)

    monkeypatch.setattr('sys.stdin.isatty', lambda: True)
    monkeypatch.setattr(command, '_ask', answered)
    assert init_asking(data) == 0
    first, second, third = asked
    assert first[0].endswith("\nIn which unit is 'motor position (counts)' (motor_position)")
    assert first[1] == '' and second[0].startswith('a unit is needed')
    assert 'it lacks the angle' in third[0] and 'a unit is needed' not in third[0]
    np.testing.assert_allclose(read(data)['motor_position'], run['theta'], atol=1e-3)


@pytest.mark.parametrize('label', ['_field', 'Series'])
@pytest.mark.parametrize('turns', [False, True])
def test_it_says_how_to_part_channels_that_stand_below_each_other(tmp_path, label, turns):
    rows = [(k, name, number + 0.1 * np.sin(k)) for number, name in enumerate(
        ('angle', 'current', 'voltage')) for k in range(40)]
    rows = sorted(rows, key=lambda row: row[0]) if turns else rows
    table = tmp_path / 'long.csv'
    table.write_text(f'{label},Time,Value,table\n' + '\n'.join(
        f'{name},{0.01 * k:.2f},{value:.6f},0' for k, name, value in rows))
    with pytest.raises(ValueError, match='holds its channels below each other') as problem:
        read_table(table)
    assert '(angle, current, voltage)' in str(problem.value)
    assert f"pivot_table(index='Time', columns='{label}', values='Value')" in str(problem.value)


def test_a_word_beside_channels_does_not_make_them_one(tmp_path):
    table = tmp_path / 'modes.csv'
    table.write_text('t,state,position,current\n' + '\n'.join(
        f'{0.01 * (k % 20):.2f},{"run" if k < 20 else "stop"},{k},{k % 7}' for k in range(40)))
    assert 'position' in read_table(table).columns


def test_it_offers_no_speed_for_an_angle(tmp_path, capsys):
    table = tmp_path / 'speed.csv'
    table.write_text('t [s],voltage,velocity [rad/s],r0482,r0080 [N m]\n' + '\n'.join(
        f'{0.001 * k},{k},{np.sin(k)},{k * k},1' for k in range(40)))
    words = ['init', str(table), '-o', str(tmp_path / 's.yaml'), '--no-questions']
    assert main(words) == 2
    assert "motor_position=SOURCE:UNIT (of ['r0482'])" in capsys.readouterr().err
    table.write_text(table.read_text().replace('r0482', 'r0482 [rpm]'))
    assert main(words) == 2
    assert 'motor_position or load_position, which no column of' in capsys.readouterr().err


def test_the_short_words_of_a_scope_are_speeds():
    assert looks_like('CmdVelo') == 'reference_velocity' and looks_like('ActVelo') == ''


def test_an_oscilloscope_has_its_period_in_the_header(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,0.0E+00,5.0E-03\n'
                    '0,1.5,0.2,\n1,2.5,0.3,\n2,3.5,0.4,\n')
    table = read_table(path)
    assert table.columns['time'].tolist() == pytest.approx([0.0, 5e-3, 1e-2])
    assert table.columns['CH1'].tolist() == [1.5, 2.5, 3.5]
    assert any('the 0.005 s of the header' in one for one in table.warnings)


@pytest.mark.parametrize(('name', 'column'), [('x-axis [second]', 't'), ('X [s]', 't'),
                                              ('x [m]', ''), ('delay [s]', '')])
def test_the_axis_of_an_oscilloscope_is_the_time_by_its_unit(name, column):
    assert looks_like(name) == column


@pytest.mark.parametrize('line', [
    '(1700000000.{:06d}) can0 181#0400000010FF', '  0.{:06d} 1  181   Rx   d 4 04 00 10 FF'])
def test_frames_of_a_bus_are_refused_with_what_decodes_them(tmp_path, line):
    path = tmp_path / 'a.log'
    path.write_text('\n'.join(line.format(1000 * k) for k in range(50)) + '\n')
    with pytest.raises(ValueError, match=r'log of CAN frames.*DBC'):
        read_table(path)


def test_a_log_with_a_name_before_each_number_is_refused_with_what_takes_them_off(tmp_path):
    path = tmp_path / 'a.txt'
    path.write_text('Booting\n' + '\n'.join(f't:{k},u:{0.1 * k:.1f}, i:-1e-3' for k in range(9)))
    with pytest.raises(ValueError, match=r"name before each number, as 't:7,u:0.7, i:-1e-3'.*sed"):
        read_table(path)


def test_numbers_behind_a_key_are_no_first_row(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('Channel,Time,U\nUnit,s,V\nLength,3,3\nStart Time,01.01.2025\n'
                    ',0.000,1.5\n,0.002,2.5\n,0.004,3.5\n')
    table = read_table(path)
    assert table.columns['Time [s]'].tolist() == [0.0, 0.002, 0.004]
    assert table.columns['U [V]'].tolist() == [1.5, 2.5, 3.5]


@pytest.mark.parametrize('label', ['Label,,,', 'Label,u,i,enc'])
def test_an_oscilloscope_of_tektronix_has_its_units_and_labels_above_the_names(tmp_path, label):
    table = tmp_path / 'tek.csv'
    table.write_text('Model,MSO54\nFirmware Version,1.28\n\nWaveform Type,ANALOG,,\n'
                     'Horizontal Units,s,,\nSample Interval,0.002,,\nProbe Attenuation,10,1,1\n'
                     f'Vertical Units,V,A,V\n{label}\nTIME,CH1,CH2,CH3\n' + ''.join(
                         f'{0.002 * k:.4f},{k},{0.1 * k},{np.sin(k):.6f}\n' for k in range(40)))
    of = offered(table)
    first, *channels = of.sources
    assert (first, of.units[first]) == ('TIME [s]', 's')
    assert channels == (['u [V]', 'i [A]', 'enc [V]'] if 'u' in label else
                        ['CH1 [V]', 'CH2 [A]', 'CH3 [V]'])
