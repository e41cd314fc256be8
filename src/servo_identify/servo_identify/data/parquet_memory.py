"""What a Parquet file takes of memory, found before its values are made."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from servo_twin.bag.fits_in_memory import check_fits

VALUE = 16  # bytes for each number of a column, as read and as we hold it
_SURE = 64 << 20  # bytes of text that need no second look
_AT_ONCE = 1024  # rows of text that are looked at together


def check_parquet(path: Path, advice: str) -> None:
    """
    Raise BagError for a file whose values take more memory than is free.

    A column may say a number or a long text once and repeat it a million times. By the metadata
    a number has its width. A text is no longer than what is packed of its column; where that may
    be too much, the texts are counted as they are stored, each once, without repeating them.
    """
    from pyarrow import ArrowException, parquet

    try:
        with parquet.ParquetFile(path) as file:
            found, texts, rows = _by_metadata(file.metadata)
        check_fits(path, found, advice)
        for stored_once, names in texts.items():
            if not names:
                continue
            with parquet.ParquetFile(path, read_dictionary=names if stored_once else []) as file:
                for batch in file.iter_batches(rows, columns=names):
                    found += sum(map(_bytes_of, batch.columns))
                    check_fits(path, found, advice)
    except (ArrowException, OSError):
        return  # what is wrong with it is said when it is read


def _by_metadata(told: Any) -> tuple[float, dict[bool, list[str]], int]:
    """
    Return the bytes of numbers and of texts as stored, and columns whose texts may be many more.

    The columns are parted by whether their texts can be looked at without being repeated; of the
    others so many rows may be read at once.
    """
    found, most, shared, largest = 0.0, dict[str, float](), set[str](), 1
    for k in range(told.num_row_groups):
        group = told.row_group(k)
        for j in range(group.num_columns):
            column = group.column(j)
            found += VALUE * float(column.num_values)
            if column.physical_type == 'FIXED_LEN_BYTE_ARRAY':
                found += told.schema.column(j).length * float(column.num_values)
            elif column.physical_type == 'BYTE_ARRAY':
                name, size = column.path_in_schema, column.total_uncompressed_size
                found, largest = found + size, max(largest, size)
                most[name] = most.get(name, 0.0) + float(column.num_values) * size
                if 'DELTA_BYTE_ARRAY' in column.encodings:
                    shared.add(name)
    long = [name for name, size in most.items() if size > _SURE]
    texts = {True: [name for name in long if name not in shared],
             False: [name for name in long if name in shared]}
    return found, texts, min(_AT_ONCE, max(1, _SURE // largest))


def _bytes_of(column: Any) -> float:
    """Return the bytes of a column once its texts are repeated."""
    from pyarrow import compute, types

    if types.is_dictionary(column.type):
        lengths = compute.binary_length(column.dictionary).take(column.indices)
        return float(compute.sum(lengths).as_py() or 0)
    return float(column.nbytes)
