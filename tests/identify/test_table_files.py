"""The kinds of files that hold a table: what of them is read, or a sentence says why not."""

import json
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest
from scipy.io import savemat
from small_tables import SERVO, table, TIME

from servo_identify.data.import_memory import memory_of
from servo_identify.data.reading import read_recordings
from servo_identify.data.table_import import import_table
from servo_identify.data.tables import read_table
from servo_twin.bag import fits_in_memory


def test_it_reads_the_signals_of_a_scope_by_their_labels(tmp_path):
    signals = np.zeros((1, 2), [('values', 'O'), ('label', 'O')])
    signals[0, 0] = (np.array([[1.0], [2.0], [3.0]]), 'u')
    signals[0, 1] = (np.array([[0.0], [0.5], [1.0]]), 'motor angle')
    savemat(tmp_path / 'a.mat', {'scope': {'time': np.arange(3.0)[:, None], 'signals': signals}})
    read = read_table(tmp_path / 'a.mat')
    assert read['scope.signals[u].values'].tolist() == [1.0, 2.0, 3.0]
    assert read['scope.signals[motor angle].values'].tolist() == [0.0, 0.5, 1.0]
    savemat(tmp_path / 'b.mat', {'Ts': 0.002})
    with pytest.raises(ValueError, match='holds no array of numbers'):
        read_table(tmp_path / 'b.mat')


def test_a_record_may_stand_in_each_line_and_hold_another(tmp_path):
    path = tmp_path / 'a.jsonl'
    path.write_text(''.join(json.dumps({'t': 0.1 * k, 'mode': 'run', 'motor': {'q': k, 'u': 1}})
                            + '\n' for k in range(3)))
    read = read_table(path)
    assert read['motor.q'].tolist() == [0.0, 1.0, 2.0] and 'mode' in read.refused
    path.write_text('{"t": 0}\n{"t":')
    with pytest.raises(ValueError, match='is no JSON file'):
        read_table(path)


def test_an_array_of_objects_that_nobody_asks_for_is_no_harm(tmp_path):
    np.savez(tmp_path / 'a.npz', t=np.arange(3.0), motor_position=np.arange(3.0),
             about=np.array({'rig': 1}, dtype=object))
    assert len(import_table(tmp_path / 'a.npz', SERVO)) == 3
    with pytest.raises(ValueError, match="'about' is no plain array"):
        read_table(tmp_path / 'a.npz')['about']


def test_it_reads_feather_and_single_arrays_of_numpy(tmp_path):
    import pyarrow
    from pyarrow import feather
    columns = {'t': [0.0, 0.1, 0.2], 'voltage': [1.0, 2.0, 3.0], 'motor_position': [0.0, 0.5, 1.0]}
    since = pyarrow.array([0, 100_000, 200_000], pyarrow.duration('us'))
    feather.write_feather(pyarrow.table({**columns, 't': since}), tmp_path / 'a.feather')
    assert import_table(tmp_path / 'a.feather', SERVO).period == pytest.approx(0.1)
    rows = list(zip(*columns.values(), strict=True))
    np.save(tmp_path / 'a.npy', np.array(rows, [(name, float) for name in columns]))
    assert import_table(tmp_path / 'a.npy', SERVO)['voltage'].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize('name, content, text', [
    ('a.csv', '', 'has no rows'), ('a.csv', 't,voltage,motor_position\n', 'has no rows'),
    ('a.csv', 't,voltage,motor_position\n1,2\n', 'is no table'),
    ('a.csv', 't,t,motor_position\n1,2,3\n', r"no column t; it has \['t \(1\)', 't \(2\)'"),
    ('a.xyz', 'x', "suffix '.xyz' is not a table"), ('a.parquet', 'x', 'is no Parquet file'),
    ('a.json', '[]', 'has no rows'), ('nowhere.csv', None, 'does not exist')])
def test_it_says_what_is_no_table(tmp_path, name, content, text):
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises((ValueError, OSError), match=text):
        import_table(tmp_path / name, SERVO)


def test_a_frame_of_pandas_in_json_is_read_column_by_column(tmp_path):
    path = tmp_path / 'a.json'
    path.write_text(json.dumps({name: {str(k): float(x) for k, x in enumerate(column)}
                                for name, column in table().items()}))
    assert np.array_equal(import_table(path, SERVO)['motor_position'], TIME**2)


def test_mat_and_json_files_with_our_names_need_no_mapping(tmp_path):
    columns = table(pair=np.ones((200, 2)))
    savemat(tmp_path / 'a.mat', columns)
    (tmp_path / 'a.json').write_text(json.dumps(
        {name: np.asarray(column).tolist() for name, column in columns.items() if name != 'pair'}))
    for name in ('a.mat', 'a.json'):
        assert np.array_equal(import_table(tmp_path / name, SERVO)['motor_position'], TIME**2)
    savemat(tmp_path / 's.mat', {'log': columns})
    assert {'log.t', 'log.pair[1]'} <= set(read_table(tmp_path / 's.mat').columns)


def test_an_npz_file_is_a_table_of_its_rows(tmp_path):
    np.savez(tmp_path / 'run.npz', t=np.arange(3), voltage=np.ones(3), gain=2.0, pair=np.ones(2))
    table = read_table(tmp_path / 'run.npz')
    assert set(table.columns) == {'t', 'voltage'}
    assert table.facts == {'gain': 2.0}
    (tmp_path / 'bad.npz').write_text('no archive')
    with pytest.raises(ValueError, match='is no NPZ file'):
        read_table(tmp_path / 'bad.npz')


@pytest.mark.parametrize(('suffix', 'packing'), [('.gz', 'gzip'), ('.bz2', 'bz2'),
                                                 ('.zst', 'zstd')])
def test_a_table_may_be_packed(tmp_path, suffix, packing):
    import pyarrow

    path = tmp_path / f'a.csv{suffix}'
    with pyarrow.output_stream(str(path), compression=packing) as file:
        file.write(b't,motor_position\n0,1\n0.1,2\n')
    table = read_table(path)
    assert table.path == path and table.columns['motor_position'].tolist() == [1.0, 2.0]
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(ValueError, match=f'{path.name} cannot be unpacked'):
        read_table(path)


def zipped(path, files):
    """Write a ZIP of texts by their names; return the path."""
    with ZipFile(path, 'w', ZIP_DEFLATED) as packed:
        for name, text in files.items():
            packed.writestr(name, text)
    return path


@pytest.mark.parametrize('name', ['a.csv.zip', 'a.zip'])
def test_the_one_table_in_a_zip_is_read_whatever_its_name_there(tmp_path, name):
    text = 't,motor_position\n0,1\n0.1,2\n'
    path = zipped(tmp_path / name, {'../../outside.csv': text, '__MACOSX/._outside.csv': '',
                                    'logs/': '', 'logs/.hidden': ''})
    (one,) = read_recordings([tmp_path])  # a folder finds it as well
    assert one.name == 'a' and one['motor_position'].tolist() == [1.0, 2.0]
    assert [*tmp_path.rglob('*')] == [path] and not (tmp_path.parent / 'outside.csv').exists()


def test_a_zip_of_several_tables_or_of_none_is_refused_with_what_to_do(tmp_path):
    path = zipped(tmp_path / 'runs.zip', {'b/1.csv': 't', 'b/2.csv': 't'})
    for files in ({'b/1.csv': 't', 'b/2.csv': 't'}, {'1.csv': 't', '2.json': 't'}, {}):
        with pytest.raises(ValueError, match='unpack it'):
            read_table(zipped(path, files))
    path.write_bytes(b'no zip')
    with pytest.raises(ValueError, match='unpack it'):
        read_table(path)


def test_a_file_that_unpacks_to_more_than_the_memory_is_stopped(tmp_path, monkeypatch):
    path = zipped(tmp_path / 'bomb.zip', {'a.csv': '0' * 50_000_000})
    monkeypatch.setattr(fits_in_memory, 'free_memory', lambda: 2e7)
    with pytest.raises(ValueError, match=f'{path}: reading it takes about .* are free'):
        read_table(path)


def test_what_is_wrong_within_a_packed_table_is_told_of_the_file_itself(tmp_path):
    import gzip

    path = tmp_path / 'a.csv.gz'
    path.write_bytes(gzip.compress(b't,motor_position\n'))
    with pytest.raises(ValueError, match=f'^{path} has no rows'):
        read_table(path)


def test_arrays_that_unpack_to_more_than_the_memory_are_refused_before(tmp_path, monkeypatch):
    path = tmp_path / 'zeros.npz'
    np.savez_compressed(path, t=np.arange(5.0), image=np.zeros(10**6))
    assert path.stat().st_size < 10**5
    monkeypatch.setattr(fits_in_memory, 'free_memory', lambda: 1e7)
    with pytest.raises(ValueError, match='zeros.npz: reading it takes about 0.0 GiB of memory'):
        read_table(path)


def test_lists_that_unpack_to_more_than_the_memory_are_told_before(tmp_path):
    from pyarrow import parquet, Table

    path = tmp_path / 'images.parquet'
    parquet.write_table(Table.from_pydict({
        't': np.arange(10.0), 'image': [np.zeros(100_000)] * 10}), path, compression='zstd')
    assert path.stat().st_size < 10**5
    assert memory_of(path) == pytest.approx(24e6, rel=0.01)
