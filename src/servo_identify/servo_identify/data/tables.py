"""Tables as their files have them: names and numbers, not yet anybody's units."""

from __future__ import annotations

from dataclasses import dataclass, field
import json
from pathlib import Path
import re
from typing import Any
from zipfile import BadZipFile

import numpy as np

from .mat_file import load_mat

SUFFIXES = ('.csv', '.txt', '.tsv', '.parquet', '.npz', '.mat', '.json')


@dataclass(frozen=True)
class Table:
    """
    A file's columns, float64 of shape (rows,), under the file's own names.

    ``facts`` holds what the file says once: numbers and texts beside the columns.
    """

    path: Path
    columns: dict[str, np.ndarray]
    facts: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.columns:
            raise ValueError(f'{self.path} has no column {name!r}; it has {list(self.columns)}')
        return self.columns[name]


def read_table(path: Path, rows: str = '') -> Table:
    """
    Read a CSV, Parquet, NPZ, MAT or JSON file.

    ``rows`` names the list of records in a JSON file, where it is not the whole. Raises ValueError
    for another suffix, a file that does not parse, text among numbers and columns of unequal
    length, OSError for a file that cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f'{path}: suffix {suffix!r} is not a table; known are {list(SUFFIXES)}')
    if not path.is_file():
        raise FileNotFoundError(f'{path} does not exist')
    reader = {'.parquet': _parquet, '.mat': _mat, '.npz': _npz}.get(suffix, _csv)
    try:
        table = _json(path, rows) if suffix == '.json' else reader(path)
    except (ValueError, OSError):
        raise
    except Exception as error:  # of a damaged file libraries say what comes, KeyError and all
        raise ValueError(f'{path} is damaged or no {suffix[1:].upper()} file: '
                         f'{type(error).__name__} {error}') from None
    if not table.columns or not len(next(iter(table.columns.values()))):
        raise ValueError(f'{path} has no rows')
    return table


def _csv(path: Path) -> Table:
    from pyarrow import ArrowInvalid, csv

    comments = 0
    with path.open(encoding='utf-8-sig', errors='replace') as file:
        for header in file:
            if not header.startswith('#'):
                break
            comments += 1
        else:
            raise ValueError(f'{path} has no rows')
    delimiter = max(',;\t', key=header.count)
    names = [name.strip().strip('"') for name in header.rstrip('\r\n').split(delimiter)]
    if all(_is_number(name) for name in names):
        raise ValueError(f'{path} has no line of names: its first line is {header.strip()!r}; put '
                         f'the {len(names)} names of the columns above it, such as t,voltage,'
                         'motor_position')
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f'{path}: columns {twice} are there twice')
    try:
        found = csv.read_csv(
            path, read_options=csv.ReadOptions(skip_rows=comments + 1, column_names=names),
            parse_options=csv.ParseOptions(delimiter=delimiter),
            convert_options=csv.ConvertOptions(strings_can_be_null=True,
                                               decimal_point=_decimal(path, delimiter)))
    except ArrowInvalid as error:
        raise ValueError(f'{path} is no table: {error}') from None
    return Table(path, _from_arrow(path, found))


def _is_number(text: str) -> bool:
    try:
        float(text.replace(',', '.'))
    except ValueError:
        return False
    return True


def _decimal(path: Path, delimiter: str) -> str:
    """Return the sign between whole and fraction: a comma where no number has a point."""
    if delimiter == ',':
        return '.'
    with path.open(encoding='utf-8-sig', errors='replace') as file:
        begin = file.read(100_000)
    commas = re.search(r'\d,\d', begin) is not None
    return ',' if commas and re.search(r'\d\.\d', begin) is None else '.'


def _npz(path: Path) -> Table:
    try:
        with np.load(path, allow_pickle=False) as found:
            arrays = {name: found[name] for name in found.files}
    except (ValueError, OSError, EOFError, BadZipFile) as error:
        raise ValueError(f'{path} is no NPZ file of plain arrays: {error}') from None
    plain = {name: value.astype(np.float64) for name, value in arrays.items()
             if value.ndim == 1 and value.dtype.kind in 'fiub'}
    facts = {name: value.item() for name, value in arrays.items() if value.ndim == 0}
    return _longest(path, plain, facts)


def _parquet(path: Path) -> Table:
    from pyarrow import ArrowException, parquet

    try:
        return Table(path, _from_arrow(path, parquet.read_table(path)))
    except ArrowException as error:
        raise ValueError(f'{path} is no Parquet file: {error}') from None


def _from_arrow(path: Path, found: Any) -> dict[str, np.ndarray]:
    from pyarrow import types

    columns = {}
    for name, column in zip(found.column_names, found.columns, strict=True):
        kind = column.type
        if types.is_null(kind):
            columns[name] = np.full(len(column), np.nan)
        elif types.is_floating(kind) or types.is_integer(kind) or types.is_boolean(kind):
            columns[name] = column.cast('float64').to_numpy()
        else:
            columns[name] = _numbers(path, name, column.to_pylist())
    return columns


def _numbers(path: Path, name: str, values: list[Any]) -> np.ndarray:
    column = np.empty(len(values))
    for k, value in enumerate(values):
        try:
            column[k] = np.nan if value is None else float(value)
        except (TypeError, ValueError):
            raise ValueError(f'{path}: column {name!r} has {value!r} in row {k + 1}, '
                             'which is no number') from None
    return column


def _mat(path: Path) -> Table:
    found = load_mat(path)
    arrays, facts = {}, {}
    for name, value in found.items():
        if isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in 'fiub':
            arrays[name] = value.astype(np.float64)
        elif np.ndim(value) == 0 and not isinstance(value, np.ndarray):
            facts[name] = value
    return _longest(path, arrays, facts)


def _json(path: Path, rows: str) -> Table:
    try:
        content = json.loads(path.read_text('utf8'))
    except ValueError as error:
        raise ValueError(f'{path} is no JSON file: {error}') from None
    facts = {}
    if isinstance(content, dict):
        facts = {name: value for name, value in content.items()
                 if isinstance(value, (str, int, float, bool))}
        if rows:
            if rows not in content:
                raise ValueError(f'{path} has no list {rows!r}; it has {list(content)}')
            content = content[rows]
    if isinstance(content, dict):
        arrays = {name: _numbers(path, name, value) for name, value in content.items()
                  if isinstance(value, list)}
        return _longest(path, arrays, facts)
    if not isinstance(content, list) or not all(isinstance(row, dict) for row in content):
        raise ValueError(f"{path}: rows: {rows!r} is no list of records; name it with 'rows'")
    names = list(content[0]) if content else []
    return Table(path, {name: _numbers(path, name, [row.get(name) for row in content])
                        for name in names}, facts)


def _longest(path: Path, arrays: dict[str, np.ndarray], facts: dict[str, Any]) -> Table:
    """Return the columns that are as long as the longest; others are no columns of the table."""
    length = max((len(column) for column in arrays.values()), default=0)
    return Table(path, {name: column for name, column in arrays.items() if len(column) == length},
                 facts)
