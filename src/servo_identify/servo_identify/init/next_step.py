"""The command that comes after init, for all tables that are like the one that it looked at."""

from __future__ import annotations

from pathlib import Path

from ..data.csv_layout import layout_of, TEXTS


def next_command(data: Path, servo: Path, mapping: Path | None) -> list[str]:
    """Return the words of the diagnosis of a file and those like it."""
    words = ['servo-identify', 'diagnose', _alike(data), '--servo', str(servo)]
    return [*words, *(['--mapping', str(mapping)] if mapping else []), '-o', 'answer']


def _alike(data: Path) -> str:
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
