"""Stamps of whole seconds and what is beyond them, and rows that have no times at all."""

from datetime import datetime, timedelta

from init_bench import gear_motor, init, write
import numpy as np
import pytest
from small_tables import convert, SERVO, table, TIME, write_csv

from servo_identify.commands import import_table as command
from servo_identify.data.clock_times import seconds_of
from servo_identify.data.reading import read_recordings
from servo_identify.data.table_import import import_table
from servo_identify.data.tables import read_table

STAMPS = 1_700_000_000_950_000_000 + np.arange(200) * 1_000_000


def stamped(path, whole, beyond, unit=1):
    """Write a table with seconds in one column and what is beyond them in another."""
    columns = table() | {whole: STAMPS // 10**9, beyond: STAMPS % 10**9 // unit}
    del columns['t']
    return write_csv(path, columns)


@pytest.mark.parametrize('whole, beyond, unit, name', [
    ('header.stamp.sec', 'header.stamp.nanosec', 1, 'header.stamp'),
    ('stamp/secs', 'stamp/nsecs', 1, 'stamp'), ('tv_sec', 'tv_usec', 1000, 'timestamp')])
def test_seconds_and_nanoseconds_are_one_stamp(tmp_path, whole, beyond, unit, name):
    found = read_table(stamped(tmp_path / 'a.csv', whole, beyond, unit))
    assert np.diff(found[name]) == pytest.approx(1e-3) and whole not in found.columns
    assert found.first(name) == pytest.approx(STAMPS[0] * 1e-9)


@pytest.mark.parametrize('least', [0.0, 2.0**40])
def test_a_long_table_has_its_stamps_put_together_as_well(tmp_path, monkeypatch, least):
    monkeypatch.setattr(command, 'IN_PARTS_FROM', least)
    assert convert(stamped(tmp_path / 'a.csv', 'sec', 'nanosec'), tmp_path / 'bag') == 0
    one, = read_recordings([tmp_path / 'bag'])
    assert one.period == pytest.approx(1e-3) and len(one) == 200


def test_columns_that_only_sound_like_stamps_stay(tmp_path):
    columns = table(sec=TIME, nanosec=TIME * 1e9)
    assert {'sec', 'nanosec'} <= set(read_table(write_csv(tmp_path / 'a.csv', columns)).columns)


def mapped(folder, time, more=''):
    """Write a table without times and a mapping of it; return both."""
    columns = table()
    del columns['t']
    (folder / 'm.yaml').write_text(f'{more}time: {time}\ncolumns:\n'
                                   '  motor_position: {source: motor_position}\n')
    return write_csv(folder / 'a.csv', columns), folder / 'm.yaml'


@pytest.mark.parametrize('least', [0.0, 2.0**40])
def test_rows_without_times_are_counted(tmp_path, monkeypatch, least):
    monkeypatch.setattr(command, 'IN_PARTS_FROM', least)
    data, mapping = mapped(tmp_path, '{every: 0.004}')
    assert convert(data, tmp_path / 'bag', '--mapping', str(mapping)) == 0
    one, = read_recordings([tmp_path / 'bag'])
    assert (one.period, len(one)) == (pytest.approx(0.004), 200)


@pytest.mark.parametrize('time, more, said', [
    ('{every: 0}', '', 'more than 0'), ('{every: 0.1, value: 1}', '', 'every'),
    ('{every: 0.1}', 'join: true\n', 'needs a .source.')])
def test_a_count_that_cannot_be_is_refused(tmp_path, time, more, said):
    data, mapping = mapped(tmp_path, time, more)
    with pytest.raises(ValueError, match=said):
        import_table(data, SERVO, mapping=mapping)


def test_init_counts_rows_and_turns_a_sign(tmp_path, capsys):
    motor = gear_motor()
    data = write(tmp_path / 'foc.csv', {
        'uq': motor['u'], 'iq': motor['i'], 'theta': motor['theta'], 'q': -motor['q']})
    columns = [text for one in ('t=:2 ms', 'voltage=uq:V', 'current=iq:A',
                                'motor_position=theta:rad', 'load_position=-q:rad')
               for text in ('--column', one)]
    assert init(data, tmp_path, '--mechanism', 'rigid', *columns) == 0
    said = capsys.readouterr().out
    assert 'is counted, 0.002 s from row to row' in said and 'with the other sign' in said
    one, = read_recordings([data], tmp_path / 'new' / 's.yaml', tmp_path / 'new' / 'm.yaml')
    assert one['load_position'] == pytest.approx(motor['q'], abs=1e-8)


@pytest.mark.parametrize('given, said', [('t=:2 V', 'period'), ('t=:', 'period'),
                                         ('load_position=-none:rad', "no '-none'")])
def test_init_refuses_what_is_no_period_and_no_source(tmp_path, capsys, given, said):
    data = write(tmp_path / 'a.csv', gear_motor())
    assert init(data, tmp_path, '--column', given) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(('name', 'form'), [
    ('time', '%I:%M:%S.%f %p'), ('Datum', '%d.%m.%Y %H:%M:%S.%f'),
    ('stamp_of_day', '%Y-%m-%d %I:%M:%S.%f %p'), ('logged', '%H:%M:%S.%f'),
    ('time [hh:mm:ss]', '%H:%M:%S.%f'), ('stamp_of_day', '%Y-%m-%d %H:%M:%S.%f')])
def test_a_clock_is_the_time_in_s_whatever_its_name_also_over_midnight(tmp_path, name, form):
    begin = datetime(2026, 11, 30, 23, 59, 58)
    columns = gear_motor()
    stamps = [(begin + timedelta(seconds=float(t))).strftime(form) for t in columns['time']]
    rows = [','.join((name, *list(columns)[1:]))] + [','.join((stamp, *(f'{v:.9g}' for v in row)))
            for stamp, *row in zip(stamps, *list(columns.values())[1:], strict=True)]
    data = tmp_path / 'a.csv'
    data.write_text('\n'.join(rows))
    told = ['--column', 'voltage=u:V', '--column', 'current=i:A', '--column',
            'motor_position=theta:rad', '--column', 'load_position=q:rad', '--mechanism', 'rigid']
    assert init(data, tmp_path, *told) == 0
    one = import_table(data, tmp_path / 'new' / 's.yaml', mapping=tmp_path / 'new' / 'm.yaml')
    assert one.period == pytest.approx(0.002) and len(one) == 2000
    assert begin.strftime(form)[:12] in one.note


def test_a_clock_of_spanish_afternoons_is_read():
    told = ['11:59:59,8 a. m.', '11:59:59,9 a.m.', '12:00:00,0 p. m.']
    assert seconds_of(told) == pytest.approx([43199.8, 43199.9, 43200.0])
