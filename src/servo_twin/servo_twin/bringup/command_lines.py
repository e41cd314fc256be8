"""Command lines of the processes of a run: a module, or a node with its parameters."""

from __future__ import annotations

import os
from pathlib import Path
import sys


def python(module: str, *arguments: str) -> list[str]:
    """Return the command line that runs a module."""
    return [sys.executable, '-m', module, *arguments]


def node(namespace: str, module: str, values: dict[str, object], file: Path | None = None
         ) -> list[str]:
    """Return the command line of a node; ``values`` come before those of a parameter file."""
    command = [*python(module), '--ros-args', '-r', f'__ns:=/{namespace}']
    if file is not None:
        command += ['--params-file', os.fspath(file)]
    for name, value in values.items():
        text = str(value).lower() if isinstance(value, bool) else value
        command += ['-p', f'{name}:={text}']
    return command
