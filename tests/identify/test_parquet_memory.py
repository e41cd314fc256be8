"""A small Parquet file that repeats one value without end is refused before it is read."""

from __future__ import annotations

import resource

import numpy as np
import pyarrow as pa
from pyarrow import parquet
import pytest

from servo_identify.data import tables
from servo_identify.data.parquet_memory import check_parquet
from servo_twin.bag import fits_in_memory

ROWS = 40_000


def written(path, **columns):
    table = pa.table({'t': np.arange(ROWS) * 1e-3, 'current': np.zeros(ROWS)} | columns)
    parquet.write_table(table, path)
    return path


def repeated(length, rows=ROWS):
    """Return a column that says one text once, and that text in each row."""
    return pa.DictionaryArray.from_arrays(np.zeros(rows, np.int32), ['x' * length])


def only_free(monkeypatch, size):
    monkeypatch.setattr(fits_in_memory, 'free_memory', lambda: float(size))


def test_a_text_that_is_repeated_beyond_the_memory_is_refused_before_it_is(tmp_path, monkeypatch):
    path = written(tmp_path / 'run.parquet', note=repeated(100_000))
    assert path.stat().st_size < 500_000  # of 3.7 GiB
    only_free(monkeypatch, 1 << 30)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(ValueError, match=r'run.parquet: reading it takes about 1\.. GiB of memory '
                                         r'and 1\.0 GiB are free; part the table'):
        tables.read_table(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # KiB


@pytest.mark.parametrize('use', [{'use_dictionary': False, 'column_encoding': {
    't': 'PLAIN', 'note': 'DELTA_BYTE_ARRAY'}}, {}], ids=['shared beginnings', 'written out'])
def test_a_text_that_is_packed_otherwise_is_refused_as_well(use, tmp_path, monkeypatch):
    path = tmp_path / 'run.parquet'
    parquet.write_table(pa.table({'t': np.arange(2000.0), 'note': ['x' * 100_000] * 2000}), path,
                        **use)
    only_free(monkeypatch, 64 << 20)
    with pytest.raises(ValueError, match='reading it takes about 0.. GiB'):
        tables.read_table(path)


def test_numbers_of_a_million_rows_in_a_few_bytes_are_counted_by_their_width(
        tmp_path, monkeypatch):
    path = written(tmp_path / 'run.parquet', blob=pa.array(
        [b'y' * 10_000] * ROWS, pa.binary(10_000)))
    only_free(monkeypatch, 256 << 20)
    with pytest.raises(ValueError, match='reading it takes about 0.4 GiB'):
        tables.read_table(path)


def test_texts_that_repeat_are_let_through_where_they_fit(tmp_path, monkeypatch):
    path = written(tmp_path / 'run.parquet', label=repeated(20), note=repeated(5000))
    only_free(monkeypatch, 1 << 30)
    check_parquet(path, '')  # by the metadata alone it might be 8 GiB
    assert len(tables.read_table(written(path, label=repeated(20))).columns['current']) == ROWS
