"""Tables of text are read as people's loggers and programs write them."""

from pathlib import Path

import numpy as np
import pytest

from servo_identify.data.table_import import import_table
from servo_identify.data.tables import read_table, read_tables

SERVO = Path(__file__).parents[2] / 'config' / 'servos' / 'rv_bench.yaml'
ROWS = ((0.0, 1.5, 0.25), (0.002, -1.5, 0.5), (0.004, 2.5, 0.75))
NAMES = ('t', 'voltage', 'motor_position')


def lines(parting=',', numbers='{:g}'.format):
    return [parting.join(map(numbers, row)) for row in ROWS]


@pytest.mark.parametrize('above', [
    ['; logger 2.1', '; rate: 500 Hz, motor: left', 't,voltage,motor_position'],
    ['# t,voltage,motor_position'], ['% of 3 May', '%t,voltage,motor_position'],
    ['Logger of the bench', 'Operator: me', '', 't,voltage,motor_position'],
    ['t,voltage,motor_position', 's,V,rad'], ['t,voltage,motor_position', '[s],[V],-']])
def test_it_finds_the_names_among_what_stands_above_the_numbers(tmp_path, above):
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join([*above, *lines()]) + '\n')
    recording = import_table(path, SERVO)
    assert recording.period == 0.002
    assert recording['voltage'].tolist() == [1.5, -1.5, 2.5]
    assert recording['motor_position'].tolist() == [0.25, 0.5, 0.75]


@pytest.mark.parametrize('above', [
    ['Model,Scope 3024', 'Firmware,2.41', 'Memory Length,6000', ''],
    ['Writer,2,,', 'Channels,2,,', 'Date,2026/03/02,2026/03/02,2026/03/02', '*** end ***'],
    ['Name,plant', 'Type,REAL64,REAL64', 'Rate,500,500'],
    ['Net,5.35.2.1.1,5.35.2.1.1']])
def test_names_stand_below_lines_that_part_as_they_do(tmp_path, above):
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join([*above, ','.join(NAMES), *lines()]) + '\n')
    recording = import_table(path, SERVO)
    assert recording['voltage'].tolist() == [1.5, -1.5, 2.5]
    assert recording['motor_position'].tolist() == [0.25, 0.5, 0.75]


def test_a_point_above_the_rows_or_in_a_date_is_no_decimal_point(tmp_path):
    path = tmp_path / 'a.txt'
    rows = ['\t'.join((f'02.03.2026 14:03:22,{2 * k:03d}', *(f'{x:g}'.replace('.', ',')
                                                            for x in row[1:])))
            for k, row in enumerate(ROWS)]
    path.write_text('\n'.join(['Firmware 2.41', 'time\tvoltage\tmotor_position', *rows]))
    recording = import_table(path, SERVO)
    assert recording.period == pytest.approx(0.002)
    assert recording['voltage'].tolist() == [1.5, -1.5, 2.5]
    assert recording['motor_position'].tolist() == [0.25, 0.5, 0.75]


@pytest.mark.parametrize(('shown', 'period'), [
    (['02.03.2026 23:59:59,996', '02.03.2026 23:59:59,998', '03.03.2026 00:00:00,000'], 0.002),
    (['11:59:59.8 AM', '11:59:59.9 AM', '12:00:00.0 PM'], 0.1),
    (['59:59.98', '59:59.99', '00:00.00'], 0.01), (['14:03:22', '14:03:23', '14:03:24'], 1.0)])
def test_times_of_a_clock_are_seconds(tmp_path, shown, period):
    path = tmp_path / 'a.csv'
    path.write_text('t;voltage;motor_position\n' + ''.join(
        f'{one};{k};{k}\n' for k, one in enumerate(shown)))
    assert import_table(path, SERVO).period == pytest.approx(period)


@pytest.mark.parametrize(('rows', 'blamed'), [
    ('0;2,5;3,6\n1;2,5;1.081,6\n2;2,5;1,081.6\n', "'1.081,6' in row 2"),
    ("0;2.5;3\n1;2.5;1'000\n", '"1\'000" in row 2'),
    ('0,"2,650",3\n1,"2,650",4\n', "'2,650' in row 1")])
def test_it_says_of_a_number_why_its_signs_are_not_read(tmp_path, rows, blamed):
    path = tmp_path / 'a.csv'
    path.write_text('t;u;motor_position\n'.replace(';', ';' if ';' in rows else ',') + rows)
    said = ' '.join(read_table(path).refused.values())
    assert f'{blamed}, which is no number; write no sign between thousands' in said


def test_a_minus_of_a_typesetter_is_one(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('t,u\n0,\N{MINUS SIGN}1.5\n1,2\n', 'utf8')
    assert list(read_table(path)['u']) == [-1.5, 2.0]


def test_what_loggers_write_where_nothing_was_measured_is_no_number(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('t,voltage,motor_position\n0,1,0\n0.1,---,1\n0.2,N/A,2\n0.3,None,3\n')
    assert np.isnan(import_table(path, SERVO)['voltage']).tolist() == [False, True, True, True]


def test_names_that_are_there_twice_are_numbered(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('t,u,speed,speed\ns,V,rpm,rad/s\n0,1,0,2\n0.1,1,100,2\n')
    assert list(read_table(path).columns) == ['t [s]', 'u [V]', 'speed (1) [rpm]',
                                              'speed (2) [rad/s]']


def test_names_without_a_column_and_columns_without_a_name_at_the_end_are_no_harm(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join([','.join([*NAMES, 'comment']), *lines()]))
    recording = import_table(path, SERVO)
    assert len(recording) == 3 and "the rows end before ['comment']" in recording.warnings[0]
    path.write_text('\n'.join([','.join(NAMES), *(f'{one},' for one in lines())]))
    assert (len(import_table(path, SERVO)), list(read_table(path).columns)) == (3, list(NAMES))


@pytest.mark.parametrize('name', ['a.dat', 'a.LOG', 'a.asc'])
def test_text_may_have_the_name_that_a_logger_gives_it(tmp_path, name):
    path = tmp_path / name
    path.write_text('\r'.join([' '.join(NAMES), *lines(' ')]))
    assert import_table(path, SERVO)['voltage'].tolist() == [1.5, -1.5, 2.5]


def test_units_may_have_a_line_of_their_own(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join([','.join(NAMES), 'ms,mV,deg', *lines()]))
    recording = import_table(path, SERVO)
    assert recording.period == pytest.approx(2e-6)
    assert recording['voltage'] == pytest.approx([1.5e-3, -1.5e-3, 2.5e-3])
    assert recording['motor_position'] == pytest.approx(np.radians([0.25, 0.5, 0.75]))
    path.write_text('\n'.join([','.join(NAMES), 's,V,counts', *lines()]))
    with pytest.raises(ValueError, match='write 1/4096 rev in place of counts'):
        import_table(path, SERVO)


@pytest.mark.parametrize('parting', [' ', '   '])
def test_any_number_of_blanks_parts_columns(tmp_path, parting):
    path = tmp_path / 'a.txt'
    path.write_text('\n'.join(['# ' + ' '.join(NAMES), *('  ' + one for one in lines(parting))]))
    assert import_table(path, SERVO)['voltage'].tolist() == [1.5, -1.5, 2.5]


@pytest.mark.parametrize('encoding', ['utf-8', 'utf-8-sig', 'utf-16', 'latin-1'])
def test_it_reads_the_letters_of_other_programs(tmp_path, encoding):
    path = tmp_path / 'a.csv'
    text = '\r\n'.join(['t;voltage;motor_position [°]', *lines(';')]) + '\r\n'
    path.write_bytes(text.replace('.', ',').encode(encoding))
    recording = import_table(path, SERVO)
    assert recording['motor_position'] == pytest.approx(np.radians([0.25, 0.5, 0.75]))


def test_a_last_row_that_breaks_off_is_left_out_and_said(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join([','.join(NAMES), *lines(), '0.006,1.']))
    recording = import_table(path, SERVO)
    assert len(recording) == 3
    assert recording.warnings == ("the last row breaks off ('0.006,1.'): it is left out",)
    path.write_text('\n'.join([','.join(NAMES), *lines()[:1], '0.001,1.', *lines()[1:]]))
    with pytest.raises(ValueError, match='Expected 3 columns, got 2'):
        import_table(path, SERVO)


def test_stamps_in_nanoseconds_of_today_keep_their_distance(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('t [ns],motor_position,voltage\n' + ''.join(
        f'{1730000000_000000000 + k * 20_000},{k / 2},1\n' for k in range(50)))
    recording = import_table(path, SERVO)
    assert (recording.period, recording.warnings) == (20e-6, ())


def test_what_is_no_text_is_refused_as_such(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_bytes(b'\x89PNG\r\n\x1a\n\0\0\0\rIHDR')
    with pytest.raises(ValueError, match='no table of text'):
        read_table(path)


def test_it_reads_the_separators_and_comments_that_people_use(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('\ufeff# a comment\nt;voltage;motor_position\n0;1;2\n0.5;nan;3\n1.0;;4\n')
    recording = import_table(path, SERVO)
    assert recording.period == 0.5
    assert np.array_equal(recording['voltage'], [1.0, np.nan, np.nan], equal_nan=True)
    assert 'voltage is missing in 2 rows, the first is row 2' in recording.warnings[0]


def test_a_table_without_names_is_refused_with_what_to_write(tmp_path):
    (tmp_path / 'bare.csv').write_text('0.0,1.5,0.1\n0.1,1.5,0.2\n')
    with pytest.raises(ValueError, match='no line of names.*put the 3 names'):
        read_table(tmp_path / 'bare.csv')


def test_decimal_commas_are_read_between_semicolons(tmp_path):
    (tmp_path / 'comma.csv').write_text('t;voltage\n0,0;1,5\n0,001;-2,25\n')
    assert read_table(tmp_path / 'comma.csv')['voltage'].tolist() == [1.5, -2.25]


def test_a_text_column_that_nobody_asks_for_is_no_harm(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('t,voltage,motor_position,state\n0,1,2,idle\n0.1,1,2,run\n')
    assert len(import_table(path, SERVO)) == 2


def test_stamps_of_a_calendar_are_seconds(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('time,voltage,motor_position\n2026-01-01 00:00:00.000,1,2\n'
                    '2026-01-01 00:00:00.004,1,2\n')
    assert import_table(path, SERVO).period == 0.004


def test_a_mapping_names_the_columns_of_a_bare_table_and_brings_units_to_si(tmp_path):
    (tmp_path / 'bare.csv').write_text('0;1,5;4096\n2;1,5;0\n')
    mapping = tmp_path / 'm.yaml'
    mapping.write_text('names: [clock, u, counts]\ntime: {source: clock, unit: ms}\ncolumns:\n'
                       '  voltage: {source: u}\n'
                       '  motor_position: {source: counts, unit: 1/4096 rev}\n')
    one = import_table(tmp_path / 'bare.csv', SERVO, mapping=mapping)
    assert one.period == 0.002 and one['voltage'][0] == 1.5
    assert one['motor_position'][0] == pytest.approx(2.0 * np.pi)


@pytest.mark.parametrize('end', [',,\n,,\n', '\n  \n\t\n'], ids=['no cell', 'blanks'])
def test_empty_rows_at_the_end_are_left_out(tmp_path, end):
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join([','.join(NAMES), *lines()]) + '\n' + end)
    found = import_table(path, SERVO)
    assert (len(found), found.warnings) == (3, ())


@pytest.mark.parametrize('multi', [False, True])
def test_labview_files_have_their_times_and_units(tmp_path, multi):
    path, gap = tmp_path / 'a.lvm', '\t\t' if multi else '\t'
    end = '***End_of_Header***'
    names = ['X_Value', 'voltage', *['X_Value'] * multi, 'motor_position', 'Comment']
    rows = ['\t'.join(f'{x:g}' for x in (2e-3 * k, k - 9, *[2e-3 * k] * multi, k / 4)) + '\t'
            for k in range(40)]
    path.write_text('\n'.join([
        'LabVIEW Measurement\t', 'X_Columns\tOne', 'Time_Pref\tRelative', f'{end}\t', '\t',
        f'Channels\t2{gap}\t', f'Samples\t40{gap}40\t', f'Y_Unit_Label\tVolts{gap}Degrees\t',
        f'X_Dimension\tTime{gap}Time\t', f'{end}{gap}\t', '\t'.join(names), *rows]))
    found = import_table(path, SERVO)
    assert (found.period, found['voltage'].tolist()) == (0.002, list(range(-9, 31)))
    assert found['motor_position'] == pytest.approx(np.radians(np.arange(40) / 4))


def test_labview_files_without_times_are_counted_in_their_period(tmp_path):
    path = tmp_path / 'a.lvm'
    path.write_text('\n'.join([
        'LabVIEW Measurement\t', 'X_Columns\tNo', '***End_of_Header***\t', '\t',
        'Channels\t2\t\t', 'Y_Unit_Label\tVolts\tDegrees\t', 'X0\t0,0\t0,0\t',
        'Delta_X\t0,002000\t0,002000\t', '***End_of_Header***\t\t\t',
        '\tvoltage\tmotor_position\tComment',
        *(f'\t{k - 9},5\t{k / 4:.2f}'.replace('.', ',') for k in range(60))]))
    found = import_table(path, SERVO)
    assert found.period == 0.002 and found['voltage'][:2].tolist() == [-9.5, -8.5]
    assert 'they are counted in the 0.002 s of the header' in found.note


def test_labview_files_of_several_segments_are_recordings_each(tmp_path):
    path = tmp_path / 'a.lvm'
    heads = [['Channels\t2\t\t', f'Samples\t{n}\t{n}\t', 'Delta_X\t0.002\t0.002\t',
              '***End_of_Header***\t\t\t', 'X_Value\tvoltage\tmotor_position\tComment']
             for n in (60, 40)]
    path.write_text('\n'.join([
        'LabVIEW Measurement\t', 'X_Columns\tNo', '***End_of_Header***\t', '\t',
        *heads[0], *(f'\t{k - 9}\t{k / 4}\t' for k in range(60)),
        *heads[1], *(f'\t{k}\t{k / 4}\t' for k in range(40))]))
    first, second = read_tables(path)
    assert first.columns['voltage'].tolist() == list(range(-9, 51))
    assert second.columns['time'] == pytest.approx(0.002 * np.arange(40))


def test_a_line_that_breaks_off_at_its_end_does_not_part_the_names_by_blanks(tmp_path):
    rows = [f'{0.002 * k:.3f}\t{k % 9}\t{k / 4:.2f}\t' for k in range(60)]
    (tmp_path / 'a.csv').write_text('\n'.join(['t\tMotor Voltage\tMotor Angle\tNote', *rows,
                                               '0.120\t3\t15.00']))
    assert list(read_table(tmp_path / 'a.csv').columns)[:3] == [
        't', 'Motor Voltage', 'Motor Angle']


@pytest.mark.parametrize(('index', 'name'), [
    (('0', '1', '2'), ''),
    (('0 days 00:00:00', '0 days 00:00:00.002', '0 days 00:00:00.004'), 'time'),
    (('2026-03-02 14:03:22.000', '2026-03-02 14:03:22.002', '2026-03-02 14:03:22.004'), 'time'),
    (('5.5', '6.5', '7.5'), 'index')])
def test_the_index_of_a_frame_is_the_time_where_it_is_one(tmp_path, index, name):
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join([',voltage,motor_position', *(
        f'{one},{u},{q}' for one, (_, u, q) in zip(index, ROWS, strict=True))]))
    assert sorted(read_table(path).columns) == sorted(filter(None, (*NAMES[1:], name)))
    if name == 'time':
        assert import_table(path, SERVO).period == pytest.approx(0.002)


@pytest.mark.parametrize(('order', 'advice'), [
    ((0, 1, 2, 0, 1, 2), 'A second recording begins there'),
    ((0, 2, 1), 'Sort the rows by their time')])
def test_it_says_what_to_do_where_the_time_runs_backwards(tmp_path, order, advice):
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join([','.join(NAMES), *(lines()[k] for k in order)]))
    with pytest.raises(ValueError, match=advice):
        import_table(path, SERVO)


@pytest.mark.parametrize(('bits', 'unit', 'step'), [(32, 'us', 2000), (15, 'ms', 2)])
def test_a_clock_that_wraps_around_is_named_and_mended_by_a_mapping(tmp_path, bits, unit, step):
    path, mapping = tmp_path / 'a.csv', tmp_path / 'm.yaml'
    path.write_text(f't [{unit}],voltage,motor_position\n' + ''.join(
        f'{(2**bits - 10 * step + step * k) % 2**bits},1,{k / 8}\n' for k in range(40)))
    with pytest.raises(ValueError, match=f'of {bits} bit wrapped around .* wraps: {2**bits}'):
        import_table(path, SERVO)
    mapping.write_text(f'time: {{source: "t [{unit}]", wraps: {2**bits}, unit: {unit}}}\n'
                       'columns: {motor_position: {source: motor_position}}\n')
    assert import_table(path, SERVO, mapping=mapping).period == pytest.approx(0.002)


@pytest.mark.parametrize('name', ['Time', 'TIME', 'time'])
def test_the_time_may_be_written_in_large_letters(tmp_path, name):
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join([','.join([name, *NAMES[1:]]), *lines()]))
    assert import_table(path, SERVO).period == 0.002


def test_a_second_line_of_names_with_one_unit_alone_is_no_line_of_units(tmp_path):
    path = tmp_path / 'scope.csv'
    path.write_text('Time,Ch1,Ch2\nms,voltage [V],motor_position [rad]\n'
                    + '\n'.join(lines()) + '\n')
    assert list(read_table(path).columns) == ['ms', 'voltage [V]', 'motor_position [rad]']


@pytest.mark.parametrize('encoding', ['utf-16-le', 'utf-16-be', 'utf-16', 'utf-32'])
def test_text_in_two_or_four_bytes_is_read_with_and_without_a_mark(tmp_path, encoding):
    (tmp_path / 'a.csv').write_bytes(
        ('t [s],current [A]\n' + '0.0,1.5\n0.1,2.5\n' * 20).encode(encoding))
    table = read_table(tmp_path / 'a.csv')
    assert list(table.columns) == ['t [s]', 'current [A]']
    assert table.columns['current [A]'][:2].tolist() == [1.5, 2.5]


@pytest.mark.parametrize('line', ['0.001 s,2.65 V,3.6 mA', '0.001;2.65 V;3.6mA'])
def test_a_unit_behind_each_number_is_named(tmp_path, line):
    (tmp_path / 'a.csv').write_text('t,voltage,current\n' + f'{line}\n' * 9)
    with pytest.raises(ValueError, match='write numbers alone, and the unit once behind the name'):
        read_table(tmp_path / 'a.csv')


def test_numbers_of_base_sixteen_have_no_unit(tmp_path):
    (tmp_path / 'a.csv').write_text('t,a,b,c\n' + '1,0x1f,0x2e,0xa\n' * 9)
    assert read_table(tmp_path / 'a.csv').columns['a'][0] == 31.0


@pytest.mark.parametrize('separator', [';', ',', '\t'])
def test_a_row_of_empty_cells_below_the_names_hides_them_not(tmp_path, separator):
    cells = [['Zeit [ms]', 'u [V]', 'q [rad]'], ['', '', ''],
             *([str(2 * k), str(k % 7), f'{k * k}'] for k in range(20))]
    (tmp_path / 'a.csv').write_text('\n'.join(map(separator.join, cells)))
    assert tuple(read_table(tmp_path / 'a.csv').columns) == ('Zeit [ms]', 'u [V]', 'q [rad]')


def test_a_name_that_stands_twice_in_the_header_is_said_to(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('t,voltage,motor_position,motor_position\n' + ''.join(
        f'{0.001 * k},1,{k},{2 * k}\n' for k in range(20)))
    with pytest.raises(ValueError, match="the header names 'motor_position' 2 times"):
        import_table(path, SERVO)


@pytest.mark.parametrize('cell, decimal', [
    ('{:.3f}', True), ('{:.2f}', True), ('1,{:03.0f}', False)])
def test_commas_in_quotes_are_decimal_unless_they_may_part_thousands(tmp_path, cell, decimal):
    rows = [','.join(f'"{cell.format(one)}"'.replace('.', ',') for one in (k / 8, 2.0 * k))
            for k in range(20)]
    (tmp_path / 'a.csv').write_text('\n'.join(['t,motor_position', *rows]))
    found = read_table(tmp_path / 'a.csv')
    assert ('motor_position' in found.columns) == decimal
    assert not decimal or found['motor_position'] == pytest.approx(2.0 * np.arange(20))
    assert decimal or 'no sign between thousands' in found.refused['motor_position']
