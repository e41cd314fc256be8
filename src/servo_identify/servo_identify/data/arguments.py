"""What every command that takes recordings declares, and how it reads them."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

from servo_twin.commands.terminal import named_servo

if TYPE_CHECKING:
    from servo_twin.recording.recording import Recording

    from .long_bags import Long
    from .stretch import Stretch

WHAT = 'bags, rosbag2 folders, MCAP files, tables, or patterns of them'
DESPITE = 'go on where the check finds the data to contradict the servo file'


def add_data(parser: argparse.ArgumentParser, nargs: str | None = '+', servo: bool = True) -> None:
    """
    Declare BAG, --servo, --mapping, --namespace, --from and --to.

    ``nargs`` is that of BAG; ``servo`` says whether the command cannot do without a servo file.
    """
    more = {} if nargs is None else {'nargs': nargs}
    parser.add_argument('bags' if nargs else 'bag', metavar='BAG', help=WHAT, **more)
    parser.add_argument('--servo', type=named_servo, required=servo and nargs != '*',
                        metavar='S.yaml', help='servo file, or the name of a shipped one')
    parser.add_argument('--mapping', type=Path, metavar='M.yaml',
                        help='how columns of a table, or fields of messages, become channels')
    parser.add_argument('--namespace', help='rig to read where a bag has several')
    add_stretch(parser)


def add_stretch(parser: argparse.ArgumentParser) -> None:
    """Declare --from and --to."""
    parser.add_argument('--from', dest='begin', type=_instant, default=0.0, metavar='S',
                        help='leave out what comes before, s after the first sample')
    parser.add_argument('--to', dest='end', type=_instant, default=inf, metavar='S',
                        help='leave out what comes after, s after the first sample')


def _instant(text: str) -> float:
    from .stretch import instant
    value = float(text)
    try:
        return instant(value)
    except ValueError as problem:
        raise argparse.ArgumentTypeError(str(problem)) from None


def stretch_of(arguments: argparse.Namespace) -> Stretch:
    """Return what --from and --to say."""
    from .stretch import Stretch
    return Stretch(arguments.begin, arguments.end)


def recordings(arguments: argparse.Namespace, paths: Iterable[str | Path] | None = None
               ) -> list[Recording]:
    """Return the recordings that the arguments, or paths beside them, name."""
    from .reading import read_recordings
    several = arguments.bags if paths is None else paths
    return read_recordings(several, getattr(arguments, 'servo', None), arguments.mapping,
                           arguments.namespace, stretch_of(arguments))


def opened(arguments: argparse.Namespace, stack: ExitStack,
           paths: Iterable[str | Path] | None = None) -> list[Long]:
    """Return the recordings named as of :func:`recordings`, of any length, open in the stack."""
    from .reading import called, open_all
    several = arguments.bags if paths is None else paths
    return [one for path, name in called(several, arguments.mapping).items()
            for one in stack.enter_context(open_all(path, getattr(arguments, 'servo', None),
                                                    arguments.mapping, arguments.namespace, name,
                                                    stretch_of(arguments)))]


def recordings_looked_at(arguments: argparse.Namespace, *groups: Iterable[str | Path]
                         ) -> list[list[Recording]]:
    """
    Return the recordings of each group of paths, of those that are too long to be held parts.

    Two of one name are told apart, also where they are of two groups.
    """
    from .reading import read_looked_at
    every = [path for paths in groups for path in paths]
    return [read_looked_at(paths, arguments.servo, arguments.mapping, arguments.namespace, every,
                           stretch_of(arguments))
            for paths in groups]


def one_file(path: Path, command: str) -> Path:
    """Return the file that a path or pattern names; raises ValueError where it names several."""
    found = files([path])
    if len(found) > 1:
        raise ValueError(f'{path} names {len(found)} files, and {command} takes one, such as '
                         f'{found[0]}; import, check, fit and diagnose take all of them')
    return found[0]


def tables_of(paths: Iterable[str | Path]) -> list[Path]:
    """
    Return the files that paths, patterns and folders of tables name, each once.

    Raises FileNotFoundError for what is not there, ValueError for a folder without a table.
    """
    from .listing import LISTING
    from .named_files import is_folder
    from .tables import SUFFIXES

    # a shell has the listing among all files of a folder
    found = [path for path in files(paths) if path.name != LISTING]
    empty = next((path for path in found if is_folder(path)), None)
    if empty:
        raise ValueError(f'{empty} is a folder without a table; known are {list(SUFFIXES)}, also '
                         'packed (.csv.gz)')
    return found


def names_of(paths: Sequence[Path]) -> list[str]:
    """Return a name for the bag of each of several files; of two alike each gets its folder."""
    from .named_files import names_apart
    from .packed import stem_of
    return names_apart(paths, [stem_of(path) for path in paths])


def files(paths: Iterable[str | Path]) -> list[Path]:
    """Return the files that paths and patterns name; raises FileNotFoundError."""
    from .named_files import files_of
    return files_of(paths)
