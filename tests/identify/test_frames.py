"""Frames of pandas as people hold them: the time in the index, with and without a name, it ..."""

import warnings

from init_bench import gear_motor
import numpy as np
import pytest

import servo_identify as si

pandas = pytest.importorskip('pandas')
ROWS = 400


def frame(index=None):
    run = gear_motor()
    columns = {'voltage': run['u'], 'current': run['i'], 'motor_position': run['theta']}
    return pandas.DataFrame({name: values[:ROWS] for name, values in columns.items()}, index=index)


def stamps(zone='UTC'):
    first = pandas.Timestamp('2026-11-26 14:03:12', tz=zone)
    return first + pandas.to_timedelta(gear_motor()['time'][:ROWS], unit='s')


@pytest.mark.parametrize('zone', ['UTC', 'Asia/Tokyo', None])
def test_stamps_with_a_zone_are_read_in_utc_and_without_a_warning(zone):
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        one, = si.read(frame(stamps(zone)), 'dc_gearmotor')
    assert one.period == pytest.approx(0.002)
    hour = '05' if zone == 'Asia/Tokyo' else '14'
    assert f'the first row is of 2026-11-26 {hour}:03:12' in one.note


def test_stamps_in_a_column_with_a_zone_are_the_time_where_it_is_called_timestamp(tmp_path):
    held = frame().assign(timestamp=stamps())
    one, = si.read(held, 'dc_gearmotor')
    assert one.period == pytest.approx(0.002)
    held.to_parquet(tmp_path / 'a.parquet')
    frame(stamps().rename('timestamp')).to_parquet(tmp_path / 'b.parquet')
    for again in si.read([tmp_path / 'a.parquet', tmp_path / 'b.parquet'], 'dc_gearmotor'):
        assert again.period == pytest.approx(0.002) and '2026-11-26 14:03:12' in again.note


@pytest.mark.parametrize('index', [None, 0.002 * np.arange(ROWS)])
def test_it_says_what_to_do_where_the_index_may_be_the_time(index):
    with pytest.raises(ValueError, match=r"data.rename_axis\('t'\); else add the period"):
        si.read(frame(index), 'dc_gearmotor')


def test_the_first_of_several_times_that_leave_no_doubt_is_taken():
    held = frame().assign(timestamp=np.arange(ROWS), time=0.002 * np.arange(ROWS))
    one, = si.read(held, 'dc_gearmotor')
    assert one.period == pytest.approx(0.002)


def test_series_side_by_side_are_read_where_their_rows_are_the_same_and_else_refused():
    held = {name: column for name, column in frame().items()}
    held['t'] = pandas.Series(gear_motor()['time'][:ROWS])
    one, = si.read(held, 'dc_gearmotor')
    assert len(one) == ROWS
    held['current'] = held['current'][::-1]
    with pytest.raises(ValueError, match="'current' and 'voltage' have rows of another index"):
        si.read(held, 'dc_gearmotor')


def test_a_list_of_records_is_told_to_be_made_a_frame():
    with pytest.raises(ValueError, match=r'pandas.DataFrame\(records\)'):
        si.read(frame(gear_motor()['time'][:ROWS]).to_dict('records'), 'dc_gearmotor')
