"""Columns that people hold in memory: dictionaries, arrays, frames, data sets."""

from datetime import datetime, timedelta, timezone
from io import StringIO
from math import pi

import numpy as np
import pytest

import servo_identify as si

BENCH = si.load_servo('rv_bench')
TIME = np.arange(100) * 4e-3


def held(**columns):
    """Return columns of a motion, with some of them changed."""
    return {'t': TIME, 'voltage': np.cos(TIME), 'load_position': np.sin(TIME)} | columns


def test_columns_of_different_lengths_are_refused_by_name():
    time = np.arange(50) * 1e-3
    with pytest.raises(ValueError, match=r"different lengths.*'t': 50, 'load_position': 49"):
        si.read({'t': time, 'load_position': time[1:]}, BENCH)


def test_columns_in_memory_are_read_with_their_units():
    time = np.arange(2000) * 1e-3
    columns = {'t': time, 'voltage': np.sin(time),
               'load_position [deg]': 5.0 * np.sin(3.0 * time)}
    (one,) = si.read(columns, BENCH, name='mine', family='sine')
    assert one['load_position'] == pytest.approx(5.0 * pi / 180.0 * np.sin(3.0 * time))
    assert (one.name, one.family, one.servo_file) == ('mine', 'sine', BENCH.text)
    with pytest.raises(ValueError, match='has no column t'):
        si.read({'voltage': time, 'load_position': time}, BENCH)


def test_it_reads_stamps_of_a_calendar_and_several_tables_in_memory():
    stamps = np.datetime64('2026-05-04T10:00:00') + (np.arange(500) * 4).astype('timedelta64[ms]')
    columns = {'t': stamps, 'load_position': np.sin(0.1 * np.arange(500))}
    two = si.read([columns, columns], BENCH)
    assert [one.name for one in two] == ['table_1', 'table_2']
    assert two[0].period == pytest.approx(0.004)


def test_it_reads_a_structured_array_and_an_arrow_table_and_leaves_text_out():
    import pyarrow
    time = np.arange(500) * 4e-3
    columns = {'t': time, 'voltage': np.cos(time), 'load_position': np.sin(time)}
    rows = np.array(list(zip(*columns.values(), strict=True)), [(name, float) for name in columns])
    for held in (rows, pyarrow.table(columns), {**columns, 'state': ['run'] * 500}):
        (one,) = si.read(held, BENCH)
        assert np.array_equal(one['load_position'], np.sin(time))


def test_columns_in_memory_are_read_by_a_mapping_file_too(tmp_path):
    mapping = tmp_path / 'mapping.yaml'
    mapping.write_text('time: {source: clock, unit: ms}\n'
                       'columns: {load_position: {source: q, unit: deg}}\n')
    held = {'clock': np.arange(0.0, 500.0, 4.0), 'q': np.arange(125.0)}
    (one,) = si.read(held, BENCH, mapping)
    assert one.period == pytest.approx(0.004)
    assert one['load_position'] == pytest.approx(np.radians(np.arange(125.0)))


class Frame(dict):
    """Stands for a pandas frame: its columns, and an index that may have a name."""

    class index:
        name = None
        values = np.arange(0, 400, 4).astype('timedelta64[ms]')

    columns = property(dict.keys)


def test_an_index_of_times_is_the_time_whatever_its_name():
    (one,) = si.read(Frame(load_position=np.arange(100.0) / 8), BENCH)
    assert one.period == pytest.approx(0.004)


def test_a_column_of_one_column_is_read_and_several_tables_by_name_are_refused():
    columns = {'t': np.arange(9.0) / 8, 'load_position': np.arange(9.0)[:, None]}
    assert len(si.read(columns, BENCH)[0]) == 9
    columns['load_position'] = np.zeros((9, 2))
    with pytest.raises(ValueError, match=r"'load_position' has the shape \(9, 2\)"):
        si.read(columns, BENCH)


def test_columns_without_a_row_and_of_text_are_refused_by_name():
    with pytest.raises(ValueError, match='table has no rows'):
        si.read({'t': [], 'load_position': []}, BENCH)
    with pytest.raises(ValueError, match="column 'load_position' holds no numbers"):
        si.read({'t': [0.0, 0.1], 'load_position': ['a', 'b']}, BENCH)


@pytest.mark.parametrize('unit', ['unit', 'units'])
def test_units_of_an_xarray_and_durations_of_an_index_are_obeyed(unit):
    xarray, pandas = pytest.importorskip('xarray'), pytest.importorskip('pandas')
    time = np.arange(500) * 4e-3
    table = {'t': time, 'voltage': np.cos(time), 'load_position': np.sin(time)}
    degrees = xarray.Dataset({'voltage': ('t', table['voltage']), 'load_position': (
        't', table['load_position'] * 180.0 / pi, {unit: 'deg'})}, coords={'t': table['t']})
    lasting = pandas.DataFrame({'voltage': table['voltage'],
                                'load_position': table['load_position']},
                               index=pandas.to_timedelta(table['t'], unit='s').rename('t'))
    for held in (degrees, lasting):
        (one,) = si.read(held, BENCH)
        assert one['load_position'] == pytest.approx(table['load_position'])
        assert one.period == pytest.approx(0.004)


def test_what_a_masked_array_hides_was_not_measured():
    hidden = np.arange(100) % 10 == 0
    (one,) = si.read(held(voltage=np.ma.masked_array(np.cos(TIME), hidden)), BENCH)
    assert np.array_equal(np.isnan(one['voltage']), hidden)


def test_complex_numbers_are_refused_where_they_are_asked_for():
    with pytest.raises(ValueError, match="column 'voltage' holds complex numbers"):
        si.read(held(voltage=np.exp(1j * TIME)), BENCH)


def test_times_of_a_clock_are_read_as_python_has_them():
    first = datetime(2026, 5, 4, 10)
    (one,) = si.read(held(t=[first + timedelta(seconds=float(t)) for t in TIME]), BENCH)
    assert one.period == pytest.approx(0.004) and '2026-05-04 10:00:00' in one.note


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('shown', [str, lambda stamp: stamp])
def test_stamps_with_a_zone_and_stamps_as_text_are_times(shown):
    first = datetime(2026, 5, 4, 10, tzinfo=timezone(timedelta(hours=2)))
    stamps = [shown(first + timedelta(seconds=float(t))) for t in TIME]
    (one,) = si.read(held(t=stamps), BENCH)
    assert one.period == pytest.approx(0.004)


def test_the_second_line_of_a_header_of_two_is_the_unit():
    class Frame(dict):
        columns = property(dict.keys)

    (one,) = si.read(Frame({('t', 's'): TIME, ('load_position', 'deg'): TIME}), BENCH)
    assert one['load_position'] == pytest.approx(np.radians(TIME))


class Lazy:
    """Stands for a lazy frame of polars: it has columns, and nothing in them yet."""

    columns = ('t', 'load_position')
    collect = None


@pytest.mark.parametrize('given', [Lazy(), StringIO('t,load_position\n0,0\n')])
def test_a_lazy_frame_and_an_open_file_are_refused_with_what_to_give(given):
    with pytest.raises(TypeError, match=r'collect\(\) a lazy frame.*the name of an open file'):
        si.read(given, BENCH)


def test_a_servo_file_is_not_saved_where_there_is_no_folder_or_one_in_its_place(tmp_path):
    with pytest.raises(FileNotFoundError, match='there is no folder'):
        BENCH.save(tmp_path / 'none' / 'my.yaml')
    with pytest.raises(IsADirectoryError, match=r'is a folder; give the name.*rv_bench\.yaml'):
        BENCH.save(tmp_path)
