"""A sheet of a spreadsheet (XLSX) as a text of tabs, to be read as any other table of text."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

_LARGEST = 2 << 30  # bytes that a spreadsheet may hold once unpacked
FEW = 0.1  # of the rows of the sheet that is read, up to which another holds no recording


def sheet_text(path: Path, named: str = '') -> tuple[str, tuple[str, ...]]:
    """
    Return a sheet as lines of cells with tabs between, and what to mind.

    ``named`` is the sheet; left out, the one that has most rows of numbers. Of a formula the value
    is taken that the spreadsheet kept. Raises ValueError for a file that is no XLSX, for a sheet
    that is not there, and where openpyxl lacks.
    """
    try:
        from openpyxl import load_workbook
    except ImportError:
        raise ValueError(f'{path}: reading a spreadsheet needs `pip install openpyxl`; or save '
                         'the sheet as CSV') from None
    try:
        with ZipFile(path) as parts:
            if sum(one.file_size for one in parts.infolist()) > _LARGEST:
                raise ValueError(f'{path} is too large for a spreadsheet; save the sheet as CSV')
    except BadZipFile as problem:
        raise ValueError(f'{path} is no XLSX file: {problem}') from None
    book = load_workbook(path, read_only=True, data_only=True)
    try:
        if named and named not in book.sheetnames:
            raise ValueError(f'{path} has no sheet {named!r}; it has {book.sheetnames}')
        sheets = {name: list(book[name].iter_rows(values_only=True))
                  for name in ([named] if named else book.sheetnames)
                  if hasattr(book[name], 'iter_rows')}  # a chart has none
    finally:
        book.close()
    counts = {name: sum(map(_has_number, rows)) for name, rows in sheets.items()}
    chosen = max(counts, key=lambda name: counts[name], default='')
    others = [name for name, count in counts.items()
              if name != chosen and count > FEW * counts[chosen]]
    told = (f'the sheet {chosen!r} is read, which has most rows of numbers, and not {others}; '
            'rows: NAME in a mapping file chooses another',) if others else ()
    wide = max((len(row) for row in sheets.get(chosen, ())), default=0)
    return '\n'.join('\t'.join(map(_text, [*row, *[None] * (wide - len(row))]))
                     for row in sheets.get(chosen, ())), told


def _has_number(row: Sequence[Any]) -> bool:
    return any(isinstance(cell, (int, float)) for cell in row)


def _text(cell: Any) -> str:
    if cell is None:
        return ''
    if isinstance(cell, bool):
        return str(int(cell))
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    return ' '.join(str(cell).split()) if isinstance(cell, str) else str(cell)
