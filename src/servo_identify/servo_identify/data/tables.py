"""Files of tables, whatever their kind, as tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
import tempfile
from typing import Any

import numpy as np

from .csv_layout import TEXTS
from .csv_table import read_csv
from .import_memory import ADVICE
from .json_file import flat, LINES, read_json
from .json_shapes import table_of
from .lerobot import named_parts
from .mat_file import load_mat
from .matlab_objects import what_to_type
from .names_beside import with_names_beside
from .numpy_file import load_numpy
from .packed import inner_suffix, PACKED, read_packed
from .parquet_memory import check_parquet
from .rows_in_time import on_one_timeline
from .rows_in_turn import check_turns
from .several_runs import cut_before, groups_of, runs_of
from .split_stamps import with_whole_stamps
from .spreadsheet import sheet_text
from .table import from_arrow, Table, with_texts, without_empty
from .tdms_file import load_tdms
from .times_of_groups import on_rows_of_one

_HDF5 = ('.h5', '.hdf5')
_SHEETS = ('.xlsx', '.xlsm')
_ELSEWHERE = {
    **dict.fromkeys(('.xls', '.xlsb', '.ods'), 'save the sheet as XLSX or CSV'),
    **dict.fromkeys(('.trc', '.blf'), 'its CAN frames are bytes: decode them by the DBC of the '
                    'drive into a table, as by can.LogReader and cantools '
                    '(Database.decode_message)'),
    **dict.fromkeys(('.mf4', '.mdf'), 'export it as CSV, or with asammdf: '
                    'MDF(FILE).to_dataframe(raster=0.001, time_from_zero=True).to_csv(NEW), with '
                    'the period of yours'),
    **dict.fromkeys(('.svdx', '.svbx', '.tcscopex'), 'export it from the Scope of TwinCAT as CSV'),
    **dict.fromkeys(('.pkl', '.pickle', '.p', '.joblib', '.pt', '.pth'), 'a pickle may run code '
                    'and is not read: save the frame as Parquet or CSV, arrays by numpy.savez'),
    **dict.fromkeys((*PACKED, '.7z', '.tar', '.tgz'), 'unpack it first'),
    **dict.fromkeys(('.yaml', '.yml'), 'a servo file goes behind --servo, a mapping file behind '
                    '--mapping; of topics record a bag (`ros2 bag record`), else write CSV')}
"""Kinds of files that are not read, and what to do about each."""

_ARROWS = ('.feather', '.arrow', '.arrows', '.ipc')
SUFFIXES = (*TEXTS, '.parquet', *_ARROWS, '.npz', '.npy', '.mat', *_HDF5, '.tdms', *_SHEETS,
            '.json', *LINES)


def read_table(path: Path, rows: str = '', names: Sequence[str] = ()) -> Table:
    """
    Read a file of one recording; raises ValueError for one of several, and as read_tables() does.

    Arguments are those of :func:`read_tables`.
    """
    table, *more = read_tables(path, rows, names)
    if more:
        raise ValueError(f'{path} holds {1 + len(more)} recordings, {table.run} to '
                         f'{more[-1].run}, and one is wanted here: `servo-identify import` makes '
                         'a bag of each')
    return table


def read_tables(path: Path, rows: str = '', names: Sequence[str] = ()) -> list[Table]:
    """
    Read a text (CSV), Parquet, Feather, NumPy, MAT, HDF5, TDMS, XLSX or JSON; a table each run.

    Each may be packed by gzip, bzip2, zstd or xz, or alone in a ZIP (``run.csv.gz``). ``rows``
    names the list of records in a JSON file, where it is not the whole, or the sheet of a
    spreadsheet; ``names`` the columns of a text file that has no line of names. The columns of an
    array of two dimensions are called ``name[0]``, ``name[1]`` ...; those of a structure
    ``name.field``. Names that stand beside an array, in ``columns``, are those of its columns.
    Raises ValueError for another suffix, a file that does not parse, text among
    numbers and columns of unequal length, OSError for a file that cannot be read.
    """
    suffix = path.suffix.lower()
    if path.is_dir():
        raise ValueError(f'{path} is a folder without a table; name a file')
    if path.is_file() and inner_suffix(path) in SUFFIXES:
        return read_packed(path, lambda inner: read_tables(inner, rows, names))
    if suffix in _ELSEWHERE and path.exists():
        raise ValueError(f'{path}: {suffix[1:].upper()} is not read here; {_ELSEWHERE[suffix]}')
    if suffix not in SUFFIXES:
        raise ValueError(f'{path}: suffix {suffix!r} is not a table; known are {list(SUFFIXES)}, '
                         'rosbag2 folders and .mcap. Save it as CSV, or read it with pandas and '
                         'give the frame to servo_identify.read')
    if not path.is_file():
        raise FileNotFoundError(f'{path} does not exist')
    try:
        if suffix in _OF_ARRAYS:
            tables = _OF_ARRAYS[suffix](path)
        elif suffix in _OF_ARROW:
            tables = [_OF_ARROW[suffix](path)]
        else:
            tables = (_json(path, rows) if suffix in ('.json', *LINES) else
                      _sheet(path, rows, names) if suffix in _SHEETS else _csv(path, names))
    except (ValueError, OSError):
        raise
    except Exception as error:  # of a damaged file libraries say what comes, KeyError and all
        raise ValueError(f'{path} is damaged or no {suffix[1:].upper()} file: '
                         f'{type(error).__name__} {error}') from None
    for table in tables:
        if not (table.columns or table.refused) or not all(map(len, table.columns.values())):
            raise ValueError(f'{path} has no rows')
        check_turns(path, table.columns)
    return [run for table in tables for run in runs_of(with_whole_stamps(table))]


def _csv(path: Path, names: Sequence[str]) -> list[Table]:
    text = read_csv(path, names)
    table = from_arrow(path, text.table, text.told)
    if len(runs := cut_before(table, text.again)) > 1:
        return runs
    columns = on_one_timeline(without_empty(table), told := list(table.warnings))
    return [replace(table, columns=columns, warnings=tuple(told))]


def _sheet(path: Path, named: str, names: Sequence[str]) -> list[Table]:
    text, told = sheet_text(path, named)
    with tempfile.TemporaryDirectory(prefix='servo_identify_') as folder:
        scratch = Path(folder) / 'sheet.txt'
        scratch.write_text(text, 'utf8')
        try:
            tables = _csv(scratch, names)
        except ValueError as problem:
            raise ValueError(str(problem).replace(str(scratch), str(path))) from None
    return [replace(table, path=path, warnings=(*told, *table.warnings), refused={
        name: why.replace(str(scratch), str(path)) for name, why in table.refused.items()})
        for table in tables]


def _numpy(path: Path) -> list[Table]:
    return _of_arrays(path, *load_numpy(path))


def _of_arrays(path: Path, arrays: dict[str, Any], refused: dict[str, str]) -> list[Table]:
    found = list[Table]()
    for run, inner in groups_of(arrays).items():
        told = list[str]()
        columns, facts = _parted(with_names_beside(inner, told))
        columns, apart = on_rows_of_one(columns, told)
        table = _longest(path, columns, facts)
        found.append(replace(table, run=run, warnings=tuple(told), refused={
            **table.refused, **_deep(path, inner), **refused,
            **{name: f'{path}: {why}' for name, why in apart.items()}}))
    return found


def _parted(arrays: dict[str, Any]) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return columns and facts of arrays, structures and scalars."""
    columns, facts = dict[str, np.ndarray](), dict[str, Any]()
    for name, value in arrays.items():
        array = np.asarray(value)
        if array.dtype.names:  # a structure
            inner = {f'{name}.{field}': array[field].item() if array.ndim == 0 else array[field]
                     for field in array.dtype.names}
            more, told = _parted(inner)
            columns, facts = columns | more, facts | told
        elif array.dtype.kind not in 'fiub':
            if array.ndim == 0:
                facts[name] = array.item()
        elif array.ndim == 0:
            facts[name] = array.item()
        elif array.ndim == 1:
            columns[name] = array.astype(np.float64)
        elif array.ndim == 2:
            across = array.T if array.shape[0] >= array.shape[1] else array
            columns |= {f'{name}[{k}]': row.astype(np.float64) for k, row in enumerate(across)}
    return columns, facts


def _parquet(path: Path) -> Table:
    from pyarrow import ArrowException, parquet

    check_parquet(path, ADVICE)
    try:
        table = from_arrow(path, parquet.read_table(path))
        return replace(table, columns=named_parts(path, table.columns))
    except ArrowException as error:
        raise ValueError(f'{path} is no Parquet file: {error}') from None


def _feather(path: Path) -> Table:
    from pyarrow import ArrowException, feather, ipc

    try:
        with path.open('rb') as file:
            stream = not file.read(6).startswith((b'ARROW1', b'FEA1'))
        if not stream:
            return from_arrow(path, feather.read_table(path))
        with ipc.open_stream(path) as read:
            return from_arrow(path, read.read_all())
    except ArrowException as error:
        raise ValueError(f'{path} is no Feather file or stream of Arrow: {error}') from None


def _mat(path: Path) -> list[Table]:
    found, objects = load_mat(path)
    refused = {name: what_to_type(path, name, kind) for name, kind in objects.items()}
    if not any(np.ndim(value) for value in found.values()):
        raise ValueError(next(iter(refused.values()), f'{path} holds no array of numbers'))
    arrays = {name: value for name, value in found.items()
              if isinstance(name, str) and not name.startswith('__')}
    return _of_arrays(path, arrays, refused)


def _json(path: Path, rows: str) -> list[Table]:
    content = read_json(path)
    facts = {name: value for name, value in content.items() if isinstance(
        value, (str, int, float, bool))} if isinstance(content, dict) else {}
    content = table_of(path, content, rows)
    if isinstance(content, dict):
        held = with_texts(Table(path, {}), content)
        table = _longest(path, held.columns, facts)
        return [replace(table, refused=table.refused | held.refused, warnings=held.warnings)]
    records = [dict(flat(row)) for row in content]
    return [with_texts(Table(path, {}, facts), {name: [row.get(name) for row in records] for name
                                                in dict.fromkeys(chain(*records))})]


def _longest(path: Path, arrays: dict[str, np.ndarray], facts: dict[str, Any]) -> Table:
    """Return the columns that are as long as the longest; others are refused to who asks."""
    length = max((len(column) for column in arrays.values()), default=0)
    columns = {name: column for name, column in arrays.items() if len(column) == length}
    first = next(iter(columns), '')
    return Table(path, columns, facts, {
        name: f'{path}: {name!r} has {len(column)} rows and {first!r} {length}: cut them to the '
              'same length (a rollout has one state more than commands), or save them apart'
        for name, column in arrays.items() if name not in columns})


def _deep(path: Path, arrays: dict[str, Any]) -> dict[str, str]:
    """Return why arrays of three dimensions and more are no columns."""
    shapes = {name: np.shape(value) for name, value in arrays.items()
              if isinstance(value, np.ndarray) and value.dtype.kind in 'fiub'}
    return {name: f'{path}: {name!r} has the shape {shape}: save one run, of shape (rows,) or '
            '(rows, joints)' for name, shape in shapes.items() if len(shape) > 2}


_OF_ARROW = {'.parquet': _parquet} | dict.fromkeys(_ARROWS, _feather)
_OF_ARRAYS = dict.fromkeys(('.npz', '.npy'), _numpy) | dict.fromkeys(('.mat', *_HDF5), _mat) | {
    '.tdms': lambda path: _of_arrays(path, load_tdms(path), {})}
