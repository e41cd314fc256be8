"""What a target of the fuzzing is, and what all of them need."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
import io
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CONFIG = ROOT / 'config'
SERVO = CONFIG / 'servos' / 'dc_gearmotor.yaml'
SAID = (ValueError, OSError)
"""What a command prints as one line; whatever else comes out of a target is a finding."""

Take = Callable[[bytes, Path], object]
Seeds = Callable[[Path], list[bytes]]


@dataclass(frozen=True)
class Target:
    """
    One thing that reads what comes from outside.

    ``seeds(folder)`` returns good inputs, ``take(content, folder)`` reads a spoilt one; ``folder``
    is its own to write in. ``modules`` are the parsers whose coverage counts.
    """

    name: str
    text: bool
    seeds: Seeds
    take: Take
    modules: tuple[str, ...]


def files(*paths: Path) -> Seeds:
    """Return the seeds that are these files."""
    return lambda folder: [path.read_bytes() for path in paths]


def every(folder: Path, pattern: str) -> Seeds:
    """Return the seeds that are the files of a folder."""
    return files(*sorted(folder.glob(pattern)))


def answered(main: Callable[[list[str]], int], words: list[str]) -> int:
    """Run a command line, which has to end by a status of its own, with a word where it failed."""
    out, told = io.StringIO(), io.StringIO()
    try:
        with redirect_stdout(out), redirect_stderr(told):
            status = main(words)
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 2
    assert status in (0, 1, 2), status
    assert status == 0 or told.getvalue().strip() or out.getvalue().strip(), 'says nothing'
    assert 'Traceback' not in told.getvalue()
    if status:
        raise ValueError(told.getvalue() or out.getvalue())
    return status
