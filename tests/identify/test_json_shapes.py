"""The shapes in which JSON holds a table, and groups of arrays with times of their own."""

import json

import numpy as np
import pytest

from servo_identify.data.tables import read_table

COLUMNS = {'t': [0.0, 0.1, 0.2], 'current': [1.0, 2.0, 3.0]}
RECORDS = [{'t': 0.0, 'current': 1.0}, {'t': 0.1, 'current': 2.0}, {'t': 0.2, 'current': 3.0}]


def read(folder, content, rows=''):
    path = folder / 'a.json'
    path.write_text(json.dumps(content), 'utf8')
    return read_table(path, rows)


@pytest.mark.parametrize('content', [
    COLUMNS, RECORDS, {'meta': {'rig': 'b'}, 'data': COLUMNS}, {'meta': {}, 'data': RECORDS},
    {'log': {'info': {'n': 3}, 'signals': COLUMNS}, 'version': 2},
    {'columns': ['t', 'current'], 'index': [0, 1, 2], 'data': [[0.0, 1.0], [0.1, 2.0],
                                                               [0.2, 3.0]]},
    {'meta': {}, 'channels': [{'name': 't', 'data': COLUMNS['t']},
                              {'name': 'current', 'data': COLUMNS['current']}]}])
def test_it_finds_the_columns_wherever_they_stand(tmp_path, content):
    assert {name: column.tolist() for name, column in read(tmp_path, content).columns.items()
            } == COLUMNS


def test_a_record_may_lack_what_others_have(tmp_path):
    path = tmp_path / 'a.jsonl'
    path.write_text('\n'.join(map(json.dumps, [{'t': 0.0, 'msg': 'started'}, *RECORDS[1:]])))
    assert read_table(path).columns['current'][1:].tolist() == [2.0, 3.0]


def test_a_channel_has_its_unit_behind_its_name(tmp_path):
    table = read(tmp_path, [{'name': 't', 'unit': 'ms', 'values': [0, 1]},
                            {'name': 'u', 'units': 'V', 'values': [3, 4]}])
    assert list(table.columns) == ['t [ms]', 'u [V]']


def test_rows_may_be_within_more(tmp_path):
    content = {'log': {'a': COLUMNS, 'b': {'t': [0.0]}}}
    assert list(read(tmp_path, content, 'log.a').columns) == ['t', 'current']
    with pytest.raises(ValueError, match=r"no list 'log.c'; it has 'a', 'b'|log.c"):
        read(tmp_path, content, 'log.c')


def test_columns_of_several_groups_keep_their_names(tmp_path):
    content = {'time': [0, 1], 'channels': {'u': [1, 2]}}
    assert list(read(tmp_path, content).columns) == ['time', 'channels.u']


def test_lists_without_names_are_told_in_words(tmp_path):
    with pytest.raises(ValueError, match='a list of lists without the names of their columns'):
        read(tmp_path, [[0.0, 1.0], [0.1, 2.0]])


def groups(folder, **arrays):
    path = folder / 'a.npz'
    np.savez(path, **{name.replace('__', '.'): value for name, value in arrays.items()})
    return read_table(path)


def test_groups_with_times_of_their_own_are_brought_to_one(tmp_path):
    fast, slow = np.arange(0.0, 1.0, 0.01), np.arange(0.0, 1.0, 0.02)
    table = groups(tmp_path, motor__time=fast, motor__angle=3.0 * fast, load__time=slow,
                   load__angle=2.0 * slow)
    assert list(table.columns) == ['motor.time', 'motor.angle', 'load.angle']
    assert table.columns['load.angle'][:99] == pytest.approx(2.0 * fast[:99])
    assert "['load.angle'] have times of their own ('load.time')" in table.warnings[0]


def test_groups_of_as_many_rows_are_not_put_side_by_side_where_their_times_differ(tmp_path):
    time = np.arange(0.0, 1.0, 0.01)
    table = groups(tmp_path, motor__time=time, motor__angle=time, motor__current=time,
                   load__time=time + 0.5, load__angle=time + 0.5)
    assert table.columns['load.angle'][50:] == pytest.approx(time[50:])
    assert np.isnan(table.columns['load.angle'][:50]).all()


def test_groups_of_clocks_apart_are_refused_by_name(tmp_path):
    time = np.arange(0.0, 1.0, 0.01)
    table = groups(tmp_path, motor__time=time, motor__angle=time, motor__current=time,
                   load__time=time + 1.7e9, load__angle=time)
    with pytest.raises(ValueError, match='bring both to one clock and unit'):
        table['load.angle']


def test_each_signal_may_be_a_group_of_time_and_value(tmp_path):
    time = np.arange(0.0, 1.0, 0.01)
    table = groups(tmp_path, motor_position__t=time, motor_position__value=time,
                   current__t=time, current__value=time)
    assert list(table.columns) == ['time', 'motor_position.value', 'current.t', 'current.value']
