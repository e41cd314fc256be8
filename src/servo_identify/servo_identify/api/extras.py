"""Packages that the front door uses where they are installed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def needed(package: str, call: str) -> Iterator[None]:
    """Raise ImportError that says how to install a package where its import within fails."""
    try:
        yield
    except ModuleNotFoundError as problem:
        if (problem.name or '').partition('.')[0] != package:
            raise
        raise ImportError(f'{call} needs {package}: `pip install {package}`',
                          name=package) from None
