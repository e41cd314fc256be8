"""Paths as a shell reads them, ~ for a home; servo_rig_driver has its own, by the wall."""

from __future__ import annotations

from pathlib import Path


def at_home(path: str | Path) -> Path:
    """Return a path with ~ replaced; raises ValueError where no home is known for it."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        raise ValueError(f'{path}: there is no such user; give the whole path') from None
