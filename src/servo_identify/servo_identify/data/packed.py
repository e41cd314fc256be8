"""Tables that were packed one by one, as loggers do with long ones: run.csv.gz, run.zip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import lzma
from pathlib import Path
import tempfile
from typing import IO
from zipfile import BadZipFile, ZipFile, ZipInfo

from servo_twin.bag.fits_in_memory import check_fits

from .import_memory import ADVICE, check_memory
from .table import Table

PACKED = {'.gz': 'gzip', '.bz2': 'bz2', '.zst': 'zstd', '.xz': 'xz', '.zip': 'zip'}
"""How names of packed files end, and what packs them."""
_AT_ONCE = 1 << 24  # bytes that are unpacked between two looks at the memory
_OF_SYSTEMS = '__MACOSX/'
"""Where systems put files of their own in a ZIP."""


def inner_suffix(path: Path) -> str:
    """Return how the name of the table within a packed file ends; '' of a file that is not."""
    own = Path(path.stem).suffix.lower() if path.suffix.lower() in PACKED else ''
    if own or path.suffix.lower() != '.zip' or not path.is_file():
        return own
    try:
        with ZipFile(path) as packed:
            suffixes = {Path(one.filename).suffix.lower() for one in _held(packed)}
    except (BadZipFile, OSError):
        return ''
    return suffixes.pop() if len(suffixes) == 1 else ''


def stem_of(path: Path) -> str:
    """Return the name of a file without its suffix, of a packed one without both."""
    return Path(path.stem).stem if inner_suffix(path) else path.stem


def read_packed(path: Path, read: Callable[[Path], Sequence[Table]]) -> list[Table]:
    """
    Return the tables of a packed file, which is unpacked into the folder for temporary files.

    Of a ZIP that is the one file in it, whatever its name there. Raises ValueError for one that is
    damaged, that holds several or whose table does not fit the memory, and what ``read`` raises.
    """
    from pyarrow import ArrowException

    with tempfile.TemporaryDirectory(prefix='servo_identify_') as folder:
        scratch = Path(folder) / f'table{inner_suffix(path)}'
        try:
            with _unpacked(path) as source, scratch.open('wb') as target:
                while part := source.read(_AT_ONCE):
                    target.write(part)
                    check_fits(path, target.tell(), ADVICE)  # some unpack to a thousand times
        except (ArrowException, OSError, EOFError, lzma.LZMAError, BadZipFile,
                RuntimeError) as problem:  # the last of a ZIP with a password
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
    if kind == 'zip':
        return _alone(path)
    return lzma.open(path) if kind == 'xz' else CompressedInputStream(str(path), kind)


def _alone(path: Path) -> IO[bytes]:
    """Open the one file in a ZIP; raises ValueError for another number of them."""
    with ZipFile(path) as packed:
        held = _held(packed)
        if len(held) != 1:
            names = ', '.join(one.filename for one in held[:3]) + ', ...' * (len(held) > 3)
            raise ValueError(f'{path} holds {len(held)} files{f" ({names})" if held else ""}, and '
                             'a ZIP of one table is read: unpack it into a folder, and give that')
        return packed.open(held[0])


def _held(packed: ZipFile) -> list[ZipInfo]:
    """Return the files of people in a ZIP."""
    return [one for one in packed.infolist() if not one.is_dir() and not one.filename.startswith(
        _OF_SYSTEMS) and not Path(one.filename).name.startswith('.')]
