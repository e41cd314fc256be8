"""Lets atheris choose the inputs: it keeps what reaches new lines of a parser, and spoils that."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
import sys
from time import monotonic

from target import Target
from trial import judge, named, note, Trials

LONGEST = 100_000  # bytes of an input


def search(target: Target, folder: Path, seconds: float, before: Callable[[bytes], None],
           tell: Callable[[Trials], None]) -> None:
    """Try inputs for some seconds; ``tell`` hears how it stands. The process ends with it."""
    import atheris
    folder.mkdir(parents=True, exist_ok=True)
    corpus = folder.parent.parent / 'corpus'
    corpus.mkdir()
    with atheris.instrument_imports(include=list(target.modules)):
        for module in target.modules:
            import_module(module)
    for seed in target.seeds(folder):
        (corpus / named(seed)).write_bytes(seed)
    trials, told = Trials(), [0.0]

    def one(content: bytes) -> None:
        before(content)
        begin = monotonic()
        note(trials, content, *judge(target, content, folder), monotonic() - begin)
        if monotonic() - told[0] > 0.5:
            told[0] = monotonic()
            tell(trials)

    atheris.Setup([sys.argv[0], f'-max_total_time={seconds:.0f}', f'-max_len={LONGEST}',
                   '-timeout=0', '-rss_limit_mb=0', '-verbosity=0', str(corpus)], one)
    tell(trials)
    atheris.Fuzz()
