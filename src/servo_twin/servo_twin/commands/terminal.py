"""What commands share: the terminal they print to, and the files they may write."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
import sys
from typing import Any

WIDE = 200  # columns of what is no terminal: names stay whole


def terminal(stderr: bool = False, quiet: bool = False) -> Any:
    """Return a console: the terminal in its width, or lines without colours in a pipe."""
    from rich.console import Console
    stream = sys.stderr if stderr else sys.stdout
    return Console(stderr=stderr, quiet=quiet, width=None if stream.isatty() else WIDE)


def add_told(parser: argparse.ArgumentParser) -> None:
    """Declare --json and --quiet."""
    parser.add_argument('--json', metavar='FILE', help='write what was found; - prints it')
    parser.add_argument('--quiet', action='store_true', help='print less, or nothing')


def add_force(parser: argparse.ArgumentParser) -> None:
    """Declare --force."""
    parser.add_argument('--force', action='store_true', help='write over files that are there')


def tell(file: str | None, found: Any) -> bool:
    """Write what was found as JSON, to stdout for -; return whether stdout is taken by it."""
    if file is None:
        return False
    text = json.dumps(found, indent=1, default=_plain) + '\n'
    if file == '-':
        sys.stdout.write(text)
    else:
        new_file(file, True).write_text(text)
    return file == '-'


def _plain(value: Any) -> Any:
    """Return what JSON knows of a path or a number of numpy's."""
    return value.item() if hasattr(value, 'item') else str(value)


def new_file(path: str | Path, force: bool = False) -> Path:
    """Return the path of a file to write, its folder made; raises ValueError where it is there."""
    path = Path(path)
    if path.exists() and not force:
        raise ValueError(f'{path} exists already; --force writes over it')
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def new_folder(path: str | Path, force: bool, *files: str) -> Path:
    """Return a folder to write ``files`` into, made; raises ValueError where one is there."""
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise ValueError(f'{path} is a file; name a folder')
    there = [name for name in files if (path / name).exists()]
    if there and not force:
        raise ValueError(f'{path} holds {", ".join(there)} already; --force writes over them')
    path.mkdir(parents=True, exist_ok=True)
    return path
