"""One reader for data: bags of ours, bags of any messages and tables become recordings."""

from __future__ import annotations

from collections.abc import Iterable
from glob import glob, has_magic
from pathlib import Path

from servo_twin.bag import read_recording
from servo_twin.recording.recording import Recording

from .mapping import read_mapping
from .message_files import holds_messages
from .table_import import import_table
from .tables import SUFFIXES


def read_recordings(paths: Iterable[str | Path], servo: str | Path,
                    mapping: str | Path | None = None) -> list[Recording]:
    """
    Return the recordings that paths and patterns name, in their order.

    ``servo`` is the servo file and ``mapping`` the mapping file by which tables are read; a bag
    needs neither. Raises ValueError (of a bag BagError) or OSError, which name the file.
    """
    return [_read(path, Path(servo), None if mapping is None else Path(mapping))
            for named in paths for path in _files(str(named))]


def _files(named: str) -> list[Path]:
    path = Path(named).expanduser()
    if path.exists() or not has_magic(named):
        return [path]
    found = sorted(Path(one) for one in glob(str(path)))
    if not found:
        raise FileNotFoundError(f'{named}: no file or folder has a name of this pattern')
    return found


def _read(path: Path, servo: Path, mapping: Path | None) -> Recording:
    if not path.exists():
        raise FileNotFoundError(f'{path} does not exist; give a bag, or a table '
                                f'({", ".join(SUFFIXES)})')
    table = path.is_file() and path.suffix.lower() in SUFFIXES
    if table or mapping is not None and holds_messages(path) and speaks_of_topics(mapping):
        return import_table(path, servo, mapping=mapping)
    return read_recording(path)


def speaks_of_topics(mapping: Path) -> bool:
    """Tell whether a mapping file is one of messages: a bag of ours needs none."""
    return any(source.startswith('/') for source in read_mapping(mapping).sources())
