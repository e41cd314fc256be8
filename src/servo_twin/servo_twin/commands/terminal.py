"""What all commands share: the terminal, the JSON of what they found, the files they may write."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, is_dataclass
from glob import glob
import json
from math import isfinite
from pathlib import Path
import shutil
import sys
import tempfile
from typing import Any, TextIO

from ..description.whole_file import write_whole

READ = ('bag', 'bags', 'accept', 'data', 'files', 'model', 'mapping')
"""Arguments of all commands that name what is read and never written."""

WIDE = 200  # columns of what is no terminal: names stay whole


def terminal(stderr: bool = False, quiet: bool = False) -> Any:
    """Return a console: the terminal in its width, or lines without colours in a pipe."""
    from rich.console import Console

    class Plain(Console):
        """A console that leaves it to the command how to end where nobody reads on."""

        def on_broken_pipe(self) -> None:
            raise BrokenPipeError

    stream = sys.stderr if stderr else sys.stdout
    return Plain(stderr=stderr, quiet=quiet, width=None if stream.isatty() else WIDE)


def add_usual(parser: argparse.ArgumentParser, version: str = '') -> None:
    """Declare what every command takes: --json, --quiet, --force and --version."""
    usual = parser.add_argument_group('in every command')
    usual.add_argument('--json', metavar='FILE', help='write what was found as one JSON object; '
                       '- prints it, and what people read goes to stderr')
    usual.add_argument('--quiet', action='store_true', help='print the answer, or nothing')
    usual.add_argument('--force', action='store_true', help='write over files that are there')
    usual.add_argument('--version', action='version', version=version)


def named_servo(text: str) -> Path:
    """Return the servo file that an argument names; the type of every such argument."""
    from ..description.shipped import servo_at
    try:
        return servo_at(text)
    except ValueError as problem:
        raise argparse.ArgumentTypeError(str(problem)) from None


def say(arguments: argparse.Namespace, *lines: str) -> None:
    """Print what --quiet leaves out."""
    if not arguments.quiet:
        print(*lines, sep='\n', flush=True)


def tell(arguments: argparse.Namespace, **found: Any) -> None:
    """
    Keep what a command found for --json.

    Paths, dataclasses and numbers of numpy's may be in it. ``written`` lists the files and
    folders that the command wrote.
    """
    arguments.found = {**getattr(arguments, 'found', {}), **found}


def tell_now(arguments: argparse.Namespace) -> None:
    """Write what was told at once, for a command that serves until it is ended."""
    arguments.write_json({'exit_status': None})


def write_json(arguments: argparse.Namespace, stdout: TextIO, head: Mapping[str, Any],
               end: Mapping[str, Any]) -> None:
    """
    Write ``head``, what was told and ``end`` as one object, where --json asks for it.

    A file is written again when the command ends; stdout gets one object.
    """
    if arguments.json is None or arguments.json == '-' and getattr(arguments, 'printed', False):
        return
    arguments.printed = True
    found = {**head, 'written': [], **getattr(arguments, 'found', {}), **end}
    text = json.dumps(plain(found), indent=1, allow_nan=False) + '\n'
    if arguments.json == '-':
        stdout.write(text)
        stdout.flush()
    else:
        write_whole(new_file(arguments.json, True), text)


def plain(value: Any) -> Any:
    """Return a value as JSON knows it; a number that is not finite is null."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if hasattr(value, 'tolist'):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple | set):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)


def spare_what_is_read(arguments: argparse.Namespace) -> None:
    """Raise ValueError where a command would write over what it reads, even with --force."""
    given = [str(one) for name in READ if (said := getattr(arguments, name, None))
             for one in (said if isinstance(said, list) else [said])]
    read = [Path(one) for text in given for one in (text, *glob(text)) if Path(one).is_file()]
    for name in ('output', 'mapping_out', 'json'):
        path = getattr(arguments, name, None)
        if isinstance(path, str | Path) and Path(path).is_file() and any(
                one.samefile(path) for one in read):
            raise ValueError(f'--{name.replace("_", "-")} {path} is a file that is read; name '
                             'another one to write')


def judged_file(path: str | Path, force: bool = False) -> Path:
    """
    Return the path of a file to write later.

    Raises ValueError where it is there, or where nothing can be written there.
    """
    path = Path(path)
    if path.is_dir():
        raise ValueError(f'{path} exists already, and is a folder; name a file')
    if path.exists() and not force:
        raise ValueError(f'{path} exists already; --force writes over it')
    _judge(path.parent)
    return path


def new_file(path: str | Path, force: bool = False) -> Path:
    """
    Return the path of a file to write, its folder made.

    Raises ValueError where it is there, or where nothing can be written there.
    """
    path = judged_file(path, force)
    _made(path.parent)
    return path


def new_folder(path: str | Path, force: bool, *files: str) -> Path:
    """
    Return a folder to write ``files`` into, made.

    Raises ValueError where one of them is there, or where nothing can be written there.
    """
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise ValueError(f'{path} is a file; name a folder')
    there = [name for name in files if (path / name).exists()]
    if there and not force:
        raise ValueError(f'{path} holds {", ".join(there)} already; --force writes over them')
    _judge(path)
    _made(path)
    return path


def _judge(folder: Path) -> None:
    """See before the work is done that a file can be made in a folder, or the folder itself."""
    with _told(folder):
        there = next(one for one in (folder, *folder.absolute().parents) if one.exists())
        with tempfile.TemporaryFile(dir=there) as file:  # of a full disk, only a byte hears
            file.write(b'.')


def _made(folder: Path) -> None:
    with _told(folder):
        folder.mkdir(parents=True, exist_ok=True)


@contextmanager
def _told(folder: Path) -> Iterator[None]:
    """Say in a sentence that nothing can be written into a folder."""
    try:
        yield
    except OSError as problem:
        raise ValueError(f'{folder}: nothing can be written there ({problem.strerror}); choose '
                         'another place') from None


def new_bag(path: str | Path, force: bool = False) -> Path:
    """
    Return the path of a bag to write.

    Raises ValueError where something is there, or where nothing can be written there.
    With ``force`` a bag that is there stays until :func:`whole_bag`. What is no bag always stays.
    """
    path = Path(path)
    if path.exists() and not force:
        raise ValueError(f'{path} exists already; --force writes over it')
    if path.exists() and not _is_bag(path):
        raise ValueError(f'{path} is no bag, and stays as it is; choose another name')
    _judge(path.parent)
    return path


@contextmanager
def whole_bag(path: Path, measured: bool = False) -> Iterator[Path]:
    """
    Give where to write a bag that is to stand at ``path``, and make the folder that it is in.

    The bag is written beside its place and takes it once it is whole: a writing that fails leaves
    what was there as it was. What is ``measured`` cannot be had again: where nothing is there
    yet it is written in its place, and stays when the writing fails.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if measured and not path.exists():
        yield path
        return
    beside = Path(tempfile.mkdtemp(prefix=f'.{path.name}.', dir=path.parent))
    new, old = beside / path.name, beside / f'{path.name}.old'
    try:
        yield new
        if new.exists():
            if path.exists():
                new_bag(path, force=True).rename(old)
            try:
                new.rename(path)
            except OSError:
                if old.exists():
                    old.rename(path)
                raise
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _is_bag(path: Path) -> bool:
    """Return whether a folder holds nothing but what a bag is made of, and some of it."""
    held = list(path.iterdir()) if path.is_dir() else []
    return bool(held) and all(one.name == 'metadata.yaml' or one.suffix == '.mcap'
                              for one in held)
