"""Tables of text, read fast, whatever parts their columns."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
import re
from typing import Any

from .csv_layout import last_line, Layout, layout_of


def read_csv(path: Path, names: Sequence[str] = ()) -> tuple[Any, tuple[str, ...]]:
    """
    Return a table of text as an Arrow table, and what to mind of it.

    ``names`` are those of the columns of a file without a line of names. A last row that breaks
    off, since the logger was stopped in it, is left out. Raises ValueError for a file without
    names where none are given, names that are there twice, and what is no table.
    """
    from pyarrow import ArrowInvalid
    from pyarrow import csv as arrow

    layout = layout_of(path)
    columns = _names(path, layout, names)
    cut: list[str] = []

    def judge(row: Any) -> str:
        ends = not cut and row.text.strip() == last_line(path, layout.encoding).strip()
        cut.append(row.text)
        return 'skip' if ends and row.actual_columns < row.expected_columns else 'error'

    try:
        table = arrow.read_csv(
            _parted(path, layout) if layout.blanks else path,
            read_options=arrow.ReadOptions(
                skip_rows=layout.skipped, column_names=columns,
                encoding='utf8' if layout.blanks or layout.encoding == 'utf-8-sig'
                else layout.encoding),
            parse_options=arrow.ParseOptions(delimiter=layout.delimiter,
                                             invalid_row_handler=judge),
            convert_options=arrow.ConvertOptions(strings_can_be_null=True,
                                                 decimal_point=layout.decimal))
    except ArrowInvalid as error:
        raise ValueError(f'{path} is no table: {error}{_hint(layout)}') from None
    if cut and not table.num_rows:
        raise ValueError(f'{path} is no table: its only row breaks off: {cut[0].strip()!r}')
    return table, tuple(f'the last row breaks off ({text.strip()!r}): it is left out'
                        for text in cut)


def count_of_bare_columns(path: Path) -> int:
    """Return how many columns a file without a line of names has; 0 where it has names."""
    layout = layout_of(path)
    return len(layout.names) if layout.bare else 0


def _names(path: Path, layout: Layout, names: Sequence[str]) -> list[str]:
    own = layout.names
    if layout.bare and not names:
        raise ValueError(f'{path} has no line of names: its first line is '
                         f'{layout.first.strip()!r}; put the {len(own)} names of the columns '
                         'above it, such as t,voltage,motor_position, or give them in a mapping '
                         'file: names: [t, voltage, ...]')
    if layout.bare and len(names) != len(own):
        raise ValueError(f'{path} has {len(own)} columns, and the mapping names {len(names)}: '
                         f'{list(names)}')
    columns = list(names if layout.bare or layout.remark and len(names) == len(own) else own)
    twice = sorted({name for name in columns if columns.count(name) > 1})
    if twice:
        raise ValueError(f'{path}: columns {twice} are there twice')
    return columns


def _parted(path: Path, layout: Layout) -> BytesIO:
    """Return a file whose columns any number of blanks parts, with one blank between."""
    lines = path.read_text(layout.encoding).splitlines()
    return BytesIO('\n'.join(' '.join(line.split()) for line in lines).encode())


def _hint(layout: Layout) -> str:
    if layout.delimiter == ',' and re.search(r'^-?\d+,\d+,-?\d+,\d+', layout.begin, re.MULTILINE):
        return ('; where commas are decimal the columns must be parted by semicolons or tabs: '
                'export it again so')
    return ''
