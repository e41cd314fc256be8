"""Which files people name: by paths, by patterns, and by the folder that holds them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from glob import glob, has_magic
from pathlib import Path

from servo_twin.description.home_path import at_home

from .listing import LISTING
from .message_files import holds_messages
from .packed import inner_suffix
from .tables import SUFFIXES

_HIDDEN = ('.', '~$')
"""How names of files begin that systems and spreadsheets keep beside others."""


def files_of(paths: Iterable[str | Path]) -> list[Path]:
    """
    Return the files that paths, patterns and folders name, each once.

    A folder that is no bag stands for the tables and bags in it, packed ones as well; one that
    holds none stays, for what reads it to refuse. Raises FileNotFoundError for what is not there,
    ValueError for a name without a letter and for a pipe.
    """
    found = dict[Path, Path]()
    for named in paths:
        if not str(named).strip() or isinstance(named, str) and '\0' in named:
            raise ValueError(f'{named!r} names no file; give a bag, an MCAP file or a table')
        for path in _matching(str(named)):
            for one in held_in(path) or [path]:
                found.setdefault(one.resolve(), one)
    for path in found.values():
        if not path.exists():
            raise FileNotFoundError(f'{path} does not exist; give a bag, an MCAP file, or a table '
                                    f'({", ".join(SUFFIXES)})')
        if not path.is_file() and not path.is_dir():
            raise ValueError(f'{path} is a pipe or a device, which can be read once: write what '
                             'comes from it to a file, and give that')
    return list(found.values())


def is_folder(path: Path) -> bool:
    """Tell whether a path is that of a folder that is no bag itself."""
    return path.is_dir() and not holds_messages(path)


def held_in(folder: Path) -> list[Path]:
    """Return the tables and bags in a folder that is no bag itself; [] of anything else."""
    if not is_folder(folder):
        return []
    return sorted(one for one in folder.iterdir() if not one.name.startswith(_HIDDEN) and (
        holds_messages(one) or is_table(one) and one.is_file()))


def is_table(path: Path) -> bool:
    """Tell whether the name of a file ends as that of a table, which may be packed."""
    return path.suffix.lower() in SUFFIXES or inner_suffix(path) in SUFFIXES


def names_apart(paths: Sequence[Path], own: Sequence[str]) -> list[str]:
    """
    Return a name for each of several files: its ``own`` where no other has it.

    Where two are alike the suffix tells them apart, or else the folder: ``a_run`` and ``b_run`` of
    a/run.csv and b/run.csv.
    """
    names = list(own)
    for longer in (lambda path, name: '_'.join([name, *_suffixes(path, name)]),
                   lambda path, name: f'{path.absolute().parent.name}_{name}',
                   lambda path, name: '_'.join([*path.absolute().parts[1:-1], name])):
        several = [longer(path, name) for path, name in zip(paths, own, strict=True)]
        names = [known if names.count(known) == 1 else new
                 for known, new in zip(names, several, strict=True)]
    return names


def _suffixes(path: Path, name: str) -> list[str]:
    """Return what of the name of a file stands behind its name as a recording."""
    return [one for one in path.name.removeprefix(name).split('.') if one]


def _matching(named: str) -> list[Path]:
    path = at_home(named)
    if path.exists() or not has_magic(named):
        return [path]
    found = sorted(Path(one) for one in glob(str(path)) if Path(one).name != LISTING)
    if not found:
        raise FileNotFoundError(f'{named}: no file or folder has a name of this pattern')
    return found
