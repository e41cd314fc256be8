"""Rows in another order, and clocks in other forms, are read as their writer meant them."""

import numpy as np
import pytest
from small_tables import SERVO, table, TIME, write_csv

from servo_identify.data.clock_times import seconds_of
from servo_identify.data.table_import import import_table
from servo_identify.data.tables import read_table
from servo_identify.init.proposals import proposed
from servo_identify.init.sources import offered

NEWEST = 'newest first'


def turned(columns):
    return {name: column[::-1] for name, column in columns.items()}


def test_rows_that_stand_newest_first_are_turned_round_and_told(tmp_path):
    straight = import_table(write_csv(tmp_path / 'a.csv', table()), SERVO)
    found = import_table(write_csv(tmp_path / 'b.csv', turned(table())), SERVO)
    assert any(NEWEST in said for said in found.warnings) and found.start == straight.start
    for name in straight.columns:
        np.testing.assert_array_equal(found[name], straight[name])


def test_a_mapping_takes_the_first_value_of_such_rows_from_the_oldest(tmp_path):
    mapping = tmp_path / 'm.yaml'
    mapping.write_text('time: {source: t}\n'
                       'columns: {motor_position: {source: motor_position, zero: first}}\n')
    path = write_csv(tmp_path / 'a.csv', turned(table(motor_position=table()['t'] + 3.0)))
    assert import_table(path, SERVO, mapping=mapping)['motor_position'][0] == 0.0


def test_init_knows_the_time_of_such_rows(tmp_path):
    columns = turned(table())
    columns = {'log time [s]': columns.pop('t'), **columns}
    one, = proposed(offered(write_csv(tmp_path / 'a.csv', columns)))['t']
    assert (one.source, one.unit) == ('log time [s]', 's')


def test_one_row_in_a_wrong_place_turns_nothing_round(tmp_path):
    columns = turned(table())
    columns['t'] = columns['t'].copy()
    columns['t'][50] += 0.01
    with pytest.raises(ValueError, match='runs backwards'):
        import_table(write_csv(tmp_path / 'a.csv', columns), SERVO)


@pytest.mark.parametrize(('texts', 'seconds'), [
    (('14:5:0:7', '14:5:0:107', '14:5:1:7'), (0.007, 0.107, 1.007)),
    (('14:05:00:007', '14:05:00:107'), (0.007, 0.107)),
    (('14:05:00:07', '14:05:00:17'), (0.07, 0.17)),
    (('14:5:0:7', '14:5:0:100007'), (7e-6, 0.100007)),
    (('5:0:7', '5:0:107', '5:1:7'), (0.007, 0.107, 1.007)),
    (('14:05:00.5', '14:05:00.75'), (0.5, 0.75))])
def test_a_count_behind_the_seconds_of_a_clock_is_read_as_it_was_written(texts, seconds):
    found = seconds_of(texts)
    hour = 300.0 if texts[0][:2] == '5:' else 14 * 3600.0 + 300.0
    np.testing.assert_allclose(found - hour, seconds, atol=1e-9)


def test_a_count_behind_the_seconds_that_may_be_two_things_is_refused(tmp_path):
    path = write_csv(tmp_path / 'a.csv', table(t=[f'14:5:0:{k % 40}' for k in range(len(TIME))]))
    with pytest.raises(ValueError, match="'t' has '0' behind a colon .* ms or hundredths. Write"):
        import_table(path, SERVO)
    assert 't' in read_table(path).refused
