"""What the import of a file takes of memory: said before, for all of it is held at once."""

from __future__ import annotations

from pathlib import Path

from servo_twin.bag.fits_in_memory import check_fits

from .csv_layout import TEXTS
from .message_files import count_of_messages, holds_messages
from .text_encoding import BEGIN

ROW = 320  # bytes that a row of a table takes on its way into a bag: bench_limits.py
MESSAGE = 200  # bytes for each message of any topic: one of a wanted topic takes some 350
LISTED = 24  # bytes for each number of the lists in a column: images as a few letters
OF_FILE = 8  # bytes for each of a file whose rows cannot be counted beforehand
ADVICE = 'part the table, or cut the file (`ros2 bag convert`, `mcap filter`)'


def memory_of(path: Path) -> float:
    """Return the bytes of memory that the import of a file takes, roughly."""
    if holds_messages(path):
        return MESSAGE * float(count_of_messages(path))
    suffix, size = path.suffix.lower(), path.stat().st_size
    if suffix == '.parquet':
        return _memory_of_parquet(path)
    if suffix in TEXTS:
        with path.open('rb') as file:
            begin = file.read(BEGIN)
        return ROW * size * max(1, begin.count(b'\n')) / max(1, len(begin))
    return float(OF_FILE * size)


def check_memory(path: Path) -> float:
    """Return :func:`memory_of`; raises BagError where it is more than is free."""
    needed = memory_of(path)
    check_fits(path, needed, ADVICE)
    return needed


def _memory_of_parquet(path: Path) -> float:
    from pyarrow import ArrowException, parquet

    try:
        told = parquet.read_metadata(path)
        groups = [told.row_group(k) for k in range(told.num_row_groups)]
        values = [(group.column(k).num_values, group.num_rows) for group in groups
                  for k in range(group.num_columns)]
    except (ArrowException, OSError):
        return 0.0  # what is wrong with it is said when it is read
    listed = sum(count for count, rows in values if count > rows)
    return ROW * float(told.num_rows) + LISTED * float(listed)
