"""What every command that takes recordings declares, and how it reads them."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import named_servo

if TYPE_CHECKING:
    from servo_twin.recording.recording import Recording

    from .long_bags import Long

WHAT = 'bags, rosbag2 folders, MCAP files, tables, or patterns of them'


def add_data(parser: argparse.ArgumentParser, nargs: str | None = '+', servo: bool = True) -> None:
    """
    Declare BAG, --servo, --mapping and --namespace.

    ``nargs`` is that of BAG; ``servo`` says whether the command cannot do without a servo file.
    """
    more = {} if nargs is None else {'nargs': nargs}
    parser.add_argument('bags' if nargs else 'bag', metavar='BAG', help=WHAT, **more)
    parser.add_argument('--servo', type=named_servo, required=servo and nargs != '*',
                        metavar='S.yaml', help='servo file, or the name of a shipped one')
    add_reading(parser)


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Declare how data are read: --mapping and --namespace."""
    parser.add_argument('--mapping', type=Path, metavar='M.yaml',
                        help='how columns of a table, or fields of messages, become channels')
    parser.add_argument('--namespace', help='rig to read where a bag has several')


def recordings(arguments: argparse.Namespace, paths: Iterable[str | Path] | None = None
               ) -> list[Recording]:
    """Return the recordings that the arguments, or paths beside them, name."""
    from .reading import read_recordings
    several = arguments.bags if paths is None else paths
    return read_recordings(several, getattr(arguments, 'servo', None), arguments.mapping,
                           arguments.namespace)


def opened(arguments: argparse.Namespace, stack: ExitStack,
           paths: Iterable[str | Path] | None = None) -> list[Long]:
    """Return the recordings named as of :func:`recordings`, of any length, open in the stack."""
    from .reading import files_of, open_all
    several = arguments.bags if paths is None else paths
    return [one for path in files_of(several)
            for one in stack.enter_context(open_all(path, getattr(arguments, 'servo', None),
                                                    arguments.mapping, arguments.namespace))]


def recordings_looked_at(arguments: argparse.Namespace, paths: Iterable[str | Path]
                         ) -> list[Recording]:
    """Return the recordings of paths, of those that are too long to be held parts alone."""
    from .reading import read_looked_at
    return read_looked_at(paths, arguments.servo, arguments.mapping, arguments.namespace)


def one_file(path: Path, command: str) -> Path:
    """Return the file that a path or pattern names; raises ValueError where it names several."""
    found = files([path])
    if len(found) > 1:
        raise ValueError(f'{path} names {len(found)} files, and {command} takes one, such as '
                         f'{found[0]}; import, check, fit and diagnose take the pattern as it is')
    return found[0]


def tables_of(paths: Iterable[str | Path]) -> list[Path]:
    """
    Return the files that paths, patterns and folders of tables name, each once.

    Raises FileNotFoundError for what is not there, ValueError for a folder without a table.
    """
    from .listing import LISTING
    from .message_files import holds_messages
    from .tables import SUFFIXES

    found = list[Path]()
    for path in files(paths):
        if not path.is_dir() or holds_messages(path):
            if path.name != LISTING:  # as a shell has it among all files of a folder
                found.append(path)
            continue
        held = sorted(one for one in path.iterdir() if one.suffix.lower() in SUFFIXES
                      and one.is_file())
        if not held:
            raise ValueError(f'{path} is a folder without a table; known are {list(SUFFIXES)}. '
                             'Bags in it are named by a pattern')
        found += held
    return list(dict.fromkeys(found))


def names_of(paths: Sequence[Path]) -> list[str]:
    """
    Return a name for each of several files: its own without the suffix.

    Where two are alike the suffix tells them apart, or else the folder: ``a_run`` and ``b_run`` of
    a/run.csv and b/run.csv.
    """
    names = [path.stem for path in paths]
    for longer in (lambda path: path.name.replace('.', '_'),
                   lambda path: f'{path.absolute().parent.name}_{path.stem}',
                   lambda path: '_'.join(path.absolute().parts[1:]).replace('.', '_')):
        names = [longer(path) if names.count(name) > 1 else name
                 for path, name in zip(paths, names, strict=True)]
    return names


def files(paths: Iterable[str | Path]) -> list[Path]:
    """Return the files that paths and patterns name; raises FileNotFoundError."""
    from .reading import files_of
    return files_of(paths)
