"""One reader for data: bags of ours, files of any messages and tables become recordings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from servo_twin.bag import BagError, open_recording, read_recording
from servo_twin.recording.recording import Recording

from .long_bags import all_of, Long, looked_at
from .mapping import read_mapping
from .message_files import holds_messages, opened
from .named_files import files_of, held_in, is_folder, names_apart
from .packed import stem_of
from .stretch import ALL, Stretch
from .table_import import import_tables

One = TypeVar('One', Recording, Long)


def read_recordings(paths: Iterable[str | Path], servo: str | Path | None = None,
                    mapping: str | Path | None = None, namespace: str | None = None,
                    stretch: Stretch = ALL) -> list[Recording]:
    """
    Return the recordings that paths and patterns name, in their order, a stretch of each.

    ``servo`` is the servo file and ``mapping`` the mapping file by which tables and messages are
    read; a bag of ours needs neither. Without a servo file the angles of a table are not held
    against each other. ``namespace`` picks one rig of a bag with several. Raises ValueError (of a
    bag BagError) or OSError, which name the file; all are looked for before one is read.
    """
    return [one for path, name in called(paths, mapping).items()
            for one in _read(path, servo, mapping, namespace, name, stretch)]


def called(paths: Iterable[str | Path], mapping: str | Path | None = None) -> dict[Path, str]:
    """
    Return the files that paths, patterns and folders name, with a name of its own for each.

    Of two recordings of one name, a/run.csv and b/run.csv, answers would mix what is of which.
    Raises as :func:`.named_files.files_of` does.
    """
    found = files_of(paths)
    own = [stem_of(path) if _to_import(path, mapping) else path.name for path in found]
    return dict(zip(found, names_apart(found, own), strict=True))


def read_mapped(paths: Iterable[str | Path], servo: str | Path | None = None,
                mapping: str | Path | None = None, namespace: str | None = None
                ) -> list[Recording]:
    """
    Return the recordings that paths and patterns name, of long bags with columns on disk.

    Which, :func:`.long_bags.all_of` says. Arguments and errors are those of
    :func:`read_recordings`.
    """
    found = []
    for path, name in called(paths, mapping).items():
        with open_all(path, servo, mapping, namespace, name) as several:
            found += map(all_of, several)
    return found


def read_looked_at(paths: Iterable[str | Path], servo: str | Path | None = None,
                   mapping: str | Path | None = None, namespace: str | None = None,
                   beside: Iterable[str | Path] = (), stretch: Stretch = ALL
                   ) -> list[Recording]:
    """
    Return the recordings that paths and patterns name, of long ones parts alone.

    Which, :func:`.long_bags.looked_at` says. ``beside`` are paths of others, from which their
    names are to differ. Arguments and errors are those of :func:`read_recordings`.
    """
    mine, found = files_of(paths), []
    names = called([*mine, *beside], mapping)
    for path in mine:
        with open_all(path, servo, mapping, namespace, names[path], stretch) as several:
            found += [part for one in several for part in looked_at(one)]
    return found


def read_one(path: Path, servo: str | Path | None = None, mapping: str | Path | None = None,
             namespace: str | None = None) -> Recording:
    """Return the recording of one path; raises as :func:`open_one` does."""
    return _single(path, _read(path, servo, mapping, namespace))


def _read(path: Path, servo: str | Path | None, mapping: str | Path | None,
          namespace: str | None, name: str = '', stretch: Stretch = ALL) -> list[Recording]:
    if stretch != ALL or _to_import(path, mapping):
        with open_all(path, servo, mapping, namespace, name, stretch) as several:
            return [all_of(one) for one in several]
    with _known(path):
        return [replace(read_recording(path, namespace), name=name or path.name)]


def _imported(path: Path, servo: str | Path | None, mapping: str | Path | None, name: str,
              stretch: Stretch) -> list[Long]:
    """Return the recordings of a table under its name, behind which that of a run may stand."""
    return [replace(one, name=name + one.name.removeprefix(stem_of(path))) if name else one
            for one in import_tables(path, _path(servo), mapping=_path(mapping),
                                     stretch=stretch)]


def _single(path: Path, several: list[One]) -> One:
    one, *more = several
    if more:
        raise ValueError(f'{path} holds {len(several)} recordings, {one.name} to {more[-1].name}, '
                         'and one is wanted here: `servo-identify import` makes a bag of each')
    return one


@contextmanager
def open_one(path: Path, servo: str | Path | None = None, mapping: str | Path | None = None,
             namespace: str | None = None, stretch: Stretch = ALL) -> Iterator[Long]:
    """Open the recording of one path, of any length; raises ValueError for one of several."""
    with open_all(path, servo, mapping, namespace, stretch=stretch) as several:
        yield _single(path, several)


@contextmanager
def open_all(path: Path, servo: str | Path | None = None, mapping: str | Path | None = None,
             namespace: str | None = None, name: str = '', stretch: Stretch = ALL
             ) -> Iterator[list[Long]]:
    """
    Open the recordings of one path, of any length; raises as :func:`read_recordings` does.

    A bag holds one; a table may hold several, as the episodes of LeRobot. ``name`` is what it is
    called where that is not the name of its file. ``stretch`` is what is wanted of each.
    """
    if _to_import(path, mapping):
        yield _imported(path, servo, mapping, name, stretch)
        return
    with ExitStack() as opened:
        with _known(path):
            bag = opened.enter_context(open_recording(path, namespace))
        if name:
            bag.rename(name)
        yield [stretch.of(bag)]


def _path(named: str | Path | None) -> Path | None:
    return None if named is None else Path(named)


def _to_import(path: Path, mapping: str | Path | None) -> bool:
    """Tell whether a path is that of a table, or of messages of which a mapping speaks."""
    if path.is_file() and not holds_messages(path):  # a table, or what says how to make it one
        return True
    return mapping is not None and holds_messages(path) and speaks_of_topics(Path(mapping))


@contextmanager
def _known(path: Path) -> Iterator[None]:
    """Say what there is in a bag that is none of this project."""
    try:
        yield
    except BagError as problem:
        if is_folder(path):
            below = sorted(one for one in path.iterdir() if held_in(one) or holds_messages(one))
            raise BagError(f'{path} is a folder without a bag or a table' + (
                f'; those of the folders below are named by them, such as {below[0]}'
                if below else '')) from None
        strangers = _strangers(path)
        if strangers:
            raise BagError(f'{path} is no bag of this project: its topics are {strangers}. A '
                           'mapping file (--mapping) says which of their fields are what; '
                           f'`servo-identify init {path} -o S.yaml` writes '
                           'one, and config/imports has some') from None
        raise problem from None


def _strangers(path: Path) -> list[str]:
    """Return the topics of a file that holds none of our messages."""
    if not holds_messages(path):
        return []
    try:
        with opened(path) as file:
            return sorted(file.topics) if not any(
                kind.startswith('servo_twin_msgs/') for kind in file.topics.values()) else []
    except (ValueError, OSError):
        return []


def speaks_of_topics(mapping: Path) -> bool:
    """Tell whether a mapping file is one of messages: a bag of ours needs none."""
    return any(source.startswith('/') for source in read_mapping(mapping).sources())
