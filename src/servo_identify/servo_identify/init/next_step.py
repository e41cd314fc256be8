"""What comes after init, for all tables that are like the one that it looked at."""

from __future__ import annotations

from collections.abc import Container
from pathlib import Path

from ..data.csv_layout import layout_of, TEXTS

UNUSED = ('two encoders alone tell the transmission: the values of the drive take no part in it, '
          'so that any will do')


def what_it_tells(columns: Container[str]) -> str:
    """Return what a diagnosis of these columns tells: all, the transmission alone, or nothing."""
    if 'voltage' in columns or 'current' in columns:
        return 'all'
    both = 'motor_position' in columns and 'load_position' in columns
    return 'the transmission' if both else ''


def next_command(data: Path, servo: Path, mapping: Path | None) -> list[str]:
    """Return the words of the diagnosis of a file and those like it."""
    words = ['servo-identify', 'diagnose', alike(data), '--servo', str(servo)]
    return [*words, *(['--mapping', str(mapping)] if mapping else []), '-o', 'answer']


def alike(data: Path) -> str:
    """Return a pattern of the tables beside one where all have its header, else its own name."""
    if data.suffix.lower() not in TEXTS:
        return str(data)
    beside = sorted(one for one in data.parent.glob(f'*{data.suffix}') if one.is_file())
    alike = len(beside) > 1 and len(set(map(_header_of, beside))) == 1
    return str(data.parent / f'*{data.suffix}') if alike else str(data)


def _header_of(table: Path) -> tuple[str, ...] | int:
    """Return the names in a table of text, or how many columns it has without; 0 for another."""
    try:
        layout = layout_of(table)
    except ValueError:
        return 0
    return len(layout.names) if layout.bare else layout.names
