"""Tables of text, read fast, whatever parts their columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from pathlib import Path
import re
from typing import Any

import numpy as np

from .csv_layout import Layout, layout_of, MARKS
from .export_headers import is_stamp
from .number_texts import MINUS
from .rows_in_time import timelines_of
from .stray_lines import rows_alone
from .text_encoding import filled, last_line

_NOTHING = ('-', '--', '---', 'None', '?', '#NV')  # where nothing was measured, beside Arrow's
_COMMA = rf'^(\s*[-+{MINUS}]?\d*),(\d+(?:[eEdD][-+]?\d+)?\s*)$'
_GROUPS = "\\d[.'\u2019 ]\\d"  # a sign between thousands, or a decimal point
_SHOWN = 200  # letters of a line that a message shows


@dataclass(frozen=True)
class Text:
    """
    A table of text as an Arrow table.

    ``told`` says what to mind of it. ``again`` are the numbers of the rows, from 0 on, before
    which the line of names stands again.
    """

    table: Any
    told: tuple[str, ...] = ()
    again: tuple[int, ...] = ()


def read_csv(path: Path, names: Sequence[str] = ()) -> Text:
    """
    Read a table of text.

    ``names`` are those of the columns of a file without a line of names. A last row that breaks
    off, since the logger was stopped in it, is left out; so are comments among the rows, names
    that stand there again, and few rows that break off. Raises ValueError for a file without
    names where none are given, and for what is no table.
    """
    from pyarrow import ArrowInvalid, types
    from pyarrow import csv as arrow

    layout = layout_of(path)
    columns = _names(path, layout, names)
    cut: list[str] = []
    alone = None

    def judge(row: Any) -> str:
        if not row.text.strip():  # blanks alone
            return 'skip'
        ends = not cut and row.text.strip() == last_line(path, layout.encoding).strip()
        cut.append(row.text)
        return 'skip' if ends and row.actual_columns < row.expected_columns else 'error'

    options = _options(layout, columns)
    options['parse_options'].invalid_row_handler = judge
    try:
        table = arrow.read_csv(_source(path, layout), **options)
        problem = ''
    except ArrowInvalid as error:
        table, problem = None, f'{path} is no table: {error}{_hint(layout)}'
    if table is None or any(map(types.is_string, table.schema.types)):
        alone = rows_alone(path, layout)
    if alone and alone.told:
        options['read_options'] = arrow.ReadOptions(column_names=columns)
        table, cut = arrow.read_csv(BytesIO(alone.text), **options), []
    if table is None:
        raise ValueError(problem)
    if table.num_rows < 1 + bool(layout.unused) and (cut or layout.unused):
        raise ValueError(f'{path} is no table: its only row breaks off: '
                         f'{[*cut, layout.row][0].strip()!r}')
    if layout.decimal == ',':
        table = _with_points(table)
    told = [*(alone.told if alone else ()), *(
        f'the last row breaks off ({text.strip()!r}): it is left out' for text in cut
        if text.strip() != 'EOF' and not MARKS.match(text))]  # EOF ends a file of TwinCAT
    again = alone.again if alone else ()
    if layout.period and 'time' not in table.column_names:
        table = table.append_column('time', [layout.period * _counted(table.num_rows, again)])
        told.append(f'the rows have no time: they are counted in the {layout.period:g} s of '
                    'the header')
    if layout.unused:
        told.append(f'the rows end before {list(layout.unused)}: no number stands there')
    return Text(table, tuple(told), again)


def _counted(rows: int, again: Sequence[int]) -> np.ndarray:
    """Return the numbers of rows since the line of names above them, (rows,)."""
    return np.concatenate([np.arange(end - first) for first, end in pairwise([0, *again, rows])])


def numbers_in_parts(path: Path, names: Sequence[str], block: int) -> Iterator[Any]:
    """
    Yield a table of numbers alone as Arrow tables of some ``block`` bytes of text each.

    Raises ValueError as :func:`read_csv` does, and ArrowInvalid where anything is no number or
    blanks part the columns.
    """
    from pyarrow import ArrowInvalid, Table
    from pyarrow import csv as arrow

    layout = layout_of(path)
    if layout.blanks:
        raise ArrowInvalid('blanks part the columns')
    columns = _names(path, layout, names)
    stamps = any(map(is_stamp, layout.row.split(layout.delimiter)))
    if timelines_of(columns) or layout.period or stamps:
        raise ArrowInvalid('such times are held whole')
    options = _options(layout, columns)
    options['read_options'].block_size = block
    options['convert_options'].column_types = dict.fromkeys(columns, 'float64')
    with arrow.open_csv(_source(path, layout), **options) as opened:
        for batch in opened:
            yield Table.from_batches([batch])


def _options(layout: Layout, columns: list[str]) -> dict[str, Any]:
    """Return how Arrow is to read a file."""
    from pyarrow import csv as arrow

    plain = layout.blanks or layout.encoding == 'utf-8-sig'
    return {
        'read_options': arrow.ReadOptions(skip_rows=layout.skipped, column_names=columns,
                                          encoding='utf8' if plain else layout.encoding),
        'parse_options': arrow.ParseOptions(delimiter=layout.delimiter),
        'convert_options': arrow.ConvertOptions(
            strings_can_be_null=True, decimal_point=layout.decimal,
            null_values=[*arrow.ConvertOptions().null_values, *_NOTHING])}


def count_of_bare_columns(path: Path) -> int:
    """Return how many columns a file without a line of names has; 0 where it has names."""
    layout = layout_of(path)
    return len(layout.names) if layout.bare else 0


def _names(path: Path, layout: Layout, names: Sequence[str]) -> list[str]:
    own = layout.names
    if layout.bare and not names:
        above, row = (one if len(one) <= _SHOWN else f'{one[:_SHOWN]} ...'
                      for one in (layout.above.strip(), layout.row.strip()))
        raise ValueError(f'{path} has no line of names for the {len(own)} columns of its first '
                         f'row, {row!r}' + (f': above it stands {above!r}'
                                                           if above else '')
                         + f'; put the {len(own)} names of the columns above it, such as '
                         't,voltage,motor_position, or give them in a mapping file: '
                         f'names: [t, voltage, ...]{_hint(layout)}')
    if layout.bare and len(names) != len(own):
        raise ValueError(f'{path} has {len(own)} columns, and the mapping names {len(names)}: '
                         f'{list(names)}')
    return list(names if layout.bare or layout.remark and len(names) == len(own) else own)


def _source(path: Path, layout: Layout) -> Path | BytesIO:
    if layout.blanks:
        return _parted(path, layout)
    return path if layout.encoding.startswith(('utf-16', 'utf-32')) else filled(path)


def _parted(path: Path, layout: Layout) -> BytesIO:
    """Return a file whose columns any number of blanks parts, with one blank between."""
    lines = path.read_text(layout.encoding).splitlines()
    return BytesIO('\n'.join(' '.join(line.split()) for line in lines).encode())


def _with_points(table: Any) -> Any:
    """Return decimal points in columns of text, where all of their numbers have commas."""
    from pyarrow import compute, types

    for k, (name, column) in enumerate(zip(table.column_names, table.columns, strict=True)):
        if types.is_string(column.type) and not compute.any(
                compute.match_substring_regex(column, _GROUPS)).as_py():
            table = table.set_column(k, name, compute.replace_substring_regex(
                column, _COMMA, r'\1.\2'))
    return table


def _hint(layout: Layout) -> str:
    if layout.delimiter == ',' and re.match(r'\s*-?\d+,\d+,-?\d+,\d+', layout.row):
        return ('; where commas are decimal the columns must be parted by semicolons or tabs: '
                'export it again so')
    return ''
