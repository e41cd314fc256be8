"""Spreadsheets and HDF5, of MATLAB too, are read; of other kinds it says what to do."""

from datetime import datetime, timedelta
import sys

import numpy as np
import pyarrow
from pyarrow import ipc
import pytest
from scipy.io import savemat

from servo_identify.data import mat_file
from servo_identify.data.reading import read_one
from servo_identify.data.tables import read_table

TIME = np.arange(100) * 2e-3
ANGLE, VOLTAGE = np.sin(TIME) * 90.0, np.cos(TIME)
COLUMNS = ('t [s]', 'voltage [V]', 'motor_position [deg]')


@pytest.fixture
def matlab(tmp_path):
    """Return a file as MATLAB's save(..., '-v7.3') writes it."""
    h5py = pytest.importorskip('h5py')
    path = tmp_path / 'a.mat'
    with h5py.File(path, 'w', userblock_size=512) as file:
        for name, column in (('log/t', TIME), ('log/q', ANGLE), ('mass', np.array([1.5]))):
            file.create_dataset(name, data=column[None, :]).attrs['MATLAB_class'] = b'double'
        text = np.array([[ord(one)] for one in 'run 7'], dtype=np.uint16)
        file.create_dataset('note', data=text).attrs['MATLAB_class'] = np.bytes_('char')
        file.create_dataset('#refs#/a', data=TIME)
    begin = b'MATLAB 7.3 MAT-file, Platform: GLNXA64'.ljust(124) + b'\0\2IM'
    path.write_bytes(begin + path.read_bytes()[128:])
    return path


def test_it_reads_what_matlab_saves_as_version_7_3(matlab):
    found = read_table(matlab)
    assert sorted(found.columns) == ['log.q', 'log.t'] and np.array_equal(found['log.q'], ANGLE)
    assert found.facts == {'mass': 1.5, 'note': 'run 7'}


def test_cells_and_lists_of_structures_of_version_7_3_are_followed(tmp_path):
    h5py = pytest.importorskip('h5py')
    with h5py.File(tmp_path / 'a.mat', 'w') as file:
        kind, held = h5py.ref_dtype, file.create_group('#refs#')

        def cells(name, *values):
            for k, value in enumerate(values):
                held.create_dataset(f'{name.replace("/", "_")}{k}', data=value)
            made = file.create_dataset(name, (1, len(values)), dtype=kind)
            for k in range(len(values)):
                made[0, k] = held[f'{name.replace("/", "_")}{k}'].ref
            return made

        cells('runs', TIME, ANGLE).attrs['MATLAB_class'] = b'cell'
        texts = [np.array([[ord(one)] for one in name], dtype=np.uint16) for name in ('u', 'q')]
        cells('log/values', VOLTAGE, ANGLE)
        cells('log/label', *texts)
        around = file.create_dataset('around', (1,), dtype=kind)
        around[0] = around.ref  # leads back
    found = read_table(tmp_path / 'a.mat')
    assert set(found.columns) == {'runs[0]', 'runs[1]', 'log[u].values', 'log[q].values'}
    assert np.array_equal(found['log[q].values'], ANGLE)
    assert np.array_equal(found['runs[0]'], TIME)


@pytest.mark.parametrize('beside', ['columns', 'names', 'channels'])
def test_an_array_has_the_names_that_stand_beside_it(tmp_path, beside):
    data = np.column_stack([TIME, VOLTAGE, ANGLE])
    np.savez(tmp_path / 'a.npz', data=data, **{beside: np.array(COLUMNS)})
    found = read_table(tmp_path / 'a.npz')
    assert tuple(found.columns) == COLUMNS and np.array_equal(found[COLUMNS[2]], ANGLE)
    np.savez(tmp_path / 'b.npz', data=data.T, more=data, **{beside: np.array([b't', b'u', b'q'])})
    found = read_table(tmp_path / 'b.npz')
    assert set(found.columns) == {f'{one}.{name}' for one in ('data', 'more') for name in 'tuq'}
    assert np.array_equal(found['data.q'], ANGLE)
    np.savez(tmp_path / 'c.npz', data=data, names=np.array([f'row {k}' for k in range(len(data))]))
    found = read_table(tmp_path / 'c.npz')
    assert list(found.columns) == ['data[0]', 'data[1]', 'data[2]'] and not found.warnings


@pytest.mark.parametrize(('names', 'why'), [
    (np.array(['t', 'q']), "'columns' holds 2 names and no array has as many columns; data has 3"),
    (np.array(COLUMNS, dtype=object), 'numpy.array(columns, dtype=str)')])
def test_it_says_why_names_beside_an_array_are_not_used(tmp_path, names, why):
    np.savez(tmp_path / 'a.npz', data=np.column_stack([TIME, VOLTAGE, ANGLE]), columns=names)
    found = read_table(tmp_path / 'a.npz')
    assert list(found.columns) == ['data[0]', 'data[1]', 'data[2]']
    assert why in ' '.join([*found.warnings, *found.refused.values()])


def test_it_reads_hdf5_with_its_units_and_never_another_file(tmp_path):
    h5py = pytest.importorskip('h5py')
    with h5py.File(tmp_path / 'other.h5', 'w') as file:
        file['secret'] = TIME
    with h5py.File(tmp_path / 'a.h5', 'w') as file:
        file['t'], file['run/angle'] = TIME, ANGLE
        file['run/angle'].attrs['units'] = 'deg'
        file['run/rows'] = np.array(list(zip(TIME, ANGLE, strict=True)),
                                    dtype=[('t', float), ('q', float)])
        file['run/again'] = file['run']
        file['far'] = h5py.ExternalLink('other.h5', '/secret')
    found = read_table(tmp_path / 'a.h5')
    assert sorted(found.columns) == ['run.angle [deg]', 'run.rows.q', 'run.rows.t', 't']
    assert np.array_equal(found['run.rows.q'], ANGLE)


def test_a_damaged_hdf5_file_ends_in_a_sentence(matlab):
    matlab.write_bytes(matlab.read_bytes()[:700])
    with pytest.raises(ValueError, match='is no HDF5 file: '):
        read_table(matlab)


def spreadsheet(path, *sheets):
    """Write sheets, each a name and its rows."""
    book = pytest.importorskip('openpyxl').Workbook()
    book.remove(book.active)
    for name, rows in sheets:
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


def test_it_reads_the_sheet_of_a_spreadsheet_that_holds_the_numbers(tmp_path):
    rows = [['Test of 2 March', None, None], [], ['t', 'voltage', 'motor_position'],
            ['s', 'V', 'deg'], *zip(TIME.tolist(), VOLTAGE.tolist(), ANGLE.tolist(), strict=True),
            [None] * 3]
    found = read_table(spreadsheet(tmp_path / 'a.xlsx', ('Info', [['Mass', 1.5]]), ('Data', rows)))
    assert (tuple(found.columns), found.warnings) == (COLUMNS, ())
    assert found['motor_position [deg]'] == pytest.approx(ANGLE)


def test_stamps_of_a_spreadsheet_are_times_and_another_sheet_is_read_by_its_name(tmp_path):
    start = datetime(2026, 3, 2, 14, 3, 22)
    stamps = [start + timedelta(seconds=one) for one in TIME.tolist()]
    sheets = [(name, [['time', 'voltage'], *zip(stamps, values, strict=True)])
              for name, values in (('one', VOLTAGE.tolist()), ('two', ANGLE.tolist()))]
    path = spreadsheet(tmp_path / 'a.xlsx', *sheets)
    found = read_table(path)
    assert found['time'] == pytest.approx(TIME, abs=1e-6) and found['voltage'][0] == 1.0
    assert "the sheet 'one' is read" in found.warnings[0] and "['two']" in found.warnings[0]
    assert read_table(path, 'two')['voltage'] == pytest.approx(ANGLE)
    with pytest.raises(ValueError, match=r"no sheet 'three'; it has \['one', 'two'\]"):
        read_table(path, 'three')


def test_what_is_wrong_in_a_sheet_is_said_of_the_spreadsheet(tmp_path):
    path = spreadsheet(tmp_path / 'a.xlsx', ('one', [[0.0, 1.0], [0.1, 2.0], [0.2, 3.0]]))
    with pytest.raises(ValueError, match=r'a\.xlsx has no line of names'):
        read_table(path)
    path.write_bytes(b'no zip')
    with pytest.raises(ValueError, match=r'a\.xlsx is no XLSX file'):
        read_table(path)


@pytest.mark.parametrize(('name', 'library'), [('a.mat', 'h5py'), ('a.h5', 'h5py'),
                                               ('a.xlsx', 'openpyxl'), ('a.tdms', 'nptdms')])
def test_without_the_library_it_says_what_to_install(tmp_path, monkeypatch, name, library):
    (tmp_path / name).write_bytes(b'\x89HDF\r\n\x1a\n' + bytes(600))
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ValueError, match=f'`pip install {library}`'):
        read_table(tmp_path / name)


@pytest.mark.parametrize(('name', 'advice'), [
    ('a.MF4', 'with asammdf: MDF'),
    ('a.xls', 'save the sheet as XLSX or CSV'), ('a.pkl', 'a pickle may run code'),
    ('a.svdx', 'export it from the Scope of TwinCAT as CSV'), ('a.tar.gz', 'unpack it first'),
    ('a.joblib', 'may run code')])
def test_of_a_kind_that_is_not_read_it_says_what_to_do(tmp_path, name, advice):
    (tmp_path / name).write_bytes(b'x')
    for read in (read_table, read_one):
        with pytest.raises(ValueError, match=advice):
            read(tmp_path / name)


def test_objects_of_numpy_are_refused_without_the_advice_to_run_them(tmp_path):
    np.save(tmp_path / 'a.npy', {'t': ANGLE}, allow_pickle=True)
    np.savez(tmp_path / 'a.npz', t=ANGLE, run={'u': ANGLE})
    with pytest.raises(ValueError, match=r'numpy\.savez') as said:
        read_table(tmp_path / 'a.npy')
    assert 'allow_pickle' not in str(said.value)
    assert 'numpy.savez' in read_table(tmp_path / 'a.npz').refused['run']


def test_a_stream_of_arrow_is_read_as_a_file_is(tmp_path):
    held = pyarrow.table({'voltage': ANGLE})
    with ipc.new_stream(tmp_path / 'a.arrow', held.schema) as stream:
        stream.write_table(held)
    with ipc.new_file(tmp_path / 'b.ipc', held.schema) as file:
        file.write_table(held)
    for name in ('a.arrow', 'b.ipc'):
        assert read_table(tmp_path / name)['voltage'] == pytest.approx(ANGLE)


@pytest.mark.parametrize(('kind', 'words'), [
    ('timeseries', r"load\('log.mat'\); log = struct\('time', log.Time, 'data'"),
    ('timetable', r"writetimetable\(log, 'log.csv'\)"),
    ('Simulink.SimulationData.Dataset', r'for k = 1:log.numElements.*makeValidName'),
    ('my.Class', 'log_t = ...')])
def test_an_object_of_matlab_is_refused_with_what_to_type_there(tmp_path, kind, words):
    h5py = pytest.importorskip('h5py')
    with h5py.File(tmp_path / 'log.mat', 'w', userblock_size=512) as file:
        log = file.create_dataset('log', data=np.array([[0xdd000000, 2, 1, 1, 1, 1]], 'u4'))
        log.attrs['MATLAB_class'], log.attrs['MATLAB_object_decode'] = np.bytes_(kind), 3
    with pytest.raises(ValueError, match=words):
        read_table(tmp_path / 'log.mat')
    with h5py.File(tmp_path / 'log.mat', 'a') as file:
        file['t'] = np.arange(3.0)
    table = read_table(tmp_path / 'log.mat')
    assert [*table.columns] == ['t'] and kind in table.refused['log']


def test_an_object_in_a_mat_file_of_version_7_is_told_by_its_name():
    fields = [(name, object) for name in ('s0', 's1', 's2', 'arr')]
    held = np.array([(b'log', b'MCOS', b'timeseries', None)], fields)  # as scipy has it
    (name, kind), = mat_file.leaves('None', held)
    assert name == 'log' and kind.item() == (b'timeseries',)


DATA = np.column_stack([TIME, VOLTAGE, ANGLE])


def _beside(file, group):
    file[f'{group}data'] = DATA.T
    file[f'{group}names'] = [name.encode() for name in COLUMNS]


def _attribute(file, group):
    file.create_dataset(f'{group}data', data=DATA).attrs['columns'] = COLUMNS


def _of_pandas(file, group):
    file[f'{group}block0_values'] = DATA
    file[f'{group}block0_items'] = [name.encode() for name in COLUMNS]


@pytest.mark.parametrize('group', ['', 'log/'])
@pytest.mark.parametrize('written', [_beside, _attribute, _of_pandas])
def test_names_beside_an_array_of_hdf5_are_those_of_its_columns(tmp_path, written, group):
    h5py = pytest.importorskip('h5py')
    with h5py.File(tmp_path / 'a.h5', 'w') as file:
        written(file, group)
    found = read_table(tmp_path / 'a.h5')
    assert sorted(found.columns) == sorted(COLUMNS) and not found.warnings
    assert np.array_equal(found['voltage [V]'], VOLTAGE)


def test_the_label_of_a_muxed_signal_of_simulink_names_its_columns(tmp_path):
    savemat(tmp_path / 'a.mat', {'ScopeData': {'time': TIME, 'signals': {
        'values': DATA[:, 1:], 'dimensions': 2.0, 'label': 'u, q'}}})
    found = read_table(tmp_path / 'a.mat')
    assert sorted(found.columns) == ['ScopeData.time', 'q', 'u']
    assert np.array_equal(found['u'], VOLTAGE)


@pytest.mark.parametrize('within', [lambda held: held, lambda held: {'log': held}])
def test_a_cell_of_names_beside_a_matrix_of_matlab_names_its_columns(tmp_path, within):
    savemat(tmp_path / 'a.mat', within({
        'data': DATA, 'names': np.array(COLUMNS, dtype=object)}))
    found = read_table(tmp_path / 'a.mat')
    assert sorted(found.columns) == sorted(COLUMNS)
    assert np.array_equal(found['motor_position [deg]'], ANGLE)
