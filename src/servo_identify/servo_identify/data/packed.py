"""Tables that were packed one by one, as loggers do with long ones: run.csv.gz, run.csv.zst."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import lzma
from pathlib import Path
import shutil
import tempfile
from typing import IO

from .import_memory import check_memory
from .table import Table

PACKED = {'.gz': 'gzip', '.bz2': 'bz2', '.zst': 'zstd', '.xz': 'xz'}
"""How names of packed files end, and what packs them."""


def inner_suffix(path: Path) -> str:
    """Return how the name of the table within a packed file ends; '' of a file that is not."""
    return Path(path.stem).suffix.lower() if path.suffix.lower() in PACKED else ''


def stem_of(path: Path) -> str:
    """Return the name of a file without its suffix, of a packed one without both."""
    return Path(path.stem).stem if inner_suffix(path) else path.stem


def read_packed(path: Path, read: Callable[[Path], Sequence[Table]]) -> list[Table]:
    """
    Return the tables of a packed file, which is unpacked into the folder for temporary files.

    Raises ValueError for one that is damaged or whose table does not fit the memory, and what
    ``read`` raises.
    """
    from pyarrow import ArrowException

    with tempfile.TemporaryDirectory(prefix='servo_identify_') as folder:
        scratch = Path(folder) / path.stem
        try:
            with _unpacked(path) as source, scratch.open('wb') as target:
                shutil.copyfileobj(source, target)
        except (ArrowException, OSError, EOFError, lzma.LZMAError) as problem:
            raise ValueError(f'{path} cannot be unpacked: {problem}') from None
        try:
            check_memory(scratch)
            tables = read(scratch)
        except ValueError as problem:
            raise ValueError(str(problem).replace(str(scratch), str(path))) from None
        return [replace(table, path=path, refused={
            name: why.replace(str(scratch), str(path)) for name, why in table.refused.items()})
            for table in tables]


def _unpacked(path: Path) -> IO[bytes]:
    from pyarrow import CompressedInputStream

    kind = PACKED[path.suffix.lower()]
    return lzma.open(path) if kind == 'xz' else CompressedInputStream(str(path), kind)
