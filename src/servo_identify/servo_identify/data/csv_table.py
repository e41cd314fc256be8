"""Tables of text: separators, decimal commas, headers that are missing, stamps, units below."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import csv
from pathlib import Path
import re
from typing import Any

BEGIN = 100_000  # characters that are looked at before a file is read


def read_csv(path: Path, names: Sequence[str] = ()) -> Any:
    """
    Return a table of text as an Arrow table.

    ``names`` are those of the columns of a file without a line of names. Lines that begin with #
    above the names are left out. Raises ValueError for a file without names that are given, names
    that are there twice, and what is no table.
    """
    from pyarrow import ArrowInvalid
    from pyarrow import csv as arrow

    columns, delimiter, options = _options(path, names)
    try:
        return arrow.read_csv(path, **options)
    except ArrowInvalid as error:
        raise ValueError(f'{path} is no table: {error}{_hint(path, delimiter)}') from None


def numbers_in_parts(path: Path, names: Sequence[str], block: int) -> Iterator[Any]:
    """
    Yield a table of numbers alone as Arrow tables of some ``block`` bytes of text each.

    Raises ValueError as :func:`read_csv` does, and ArrowInvalid where anything is no number.
    """
    from pyarrow import csv as arrow
    from pyarrow import Table

    columns, _, options = _options(path, names)
    options['read_options'].block_size = block
    options['convert_options'].column_types = dict.fromkeys(columns, 'float64')
    with arrow.open_csv(path, **options) as opened:
        for batch in opened:
            yield Table.from_batches([batch])


def _options(path: Path, names: Sequence[str]) -> tuple[list[str], str, dict[str, Any]]:
    """Return the names of the columns, what parts them, and how Arrow is to read a file."""
    from pyarrow import csv as arrow

    comments, header, bare = _header(path)
    delimiter = delimiter_of(header)
    own = [name.strip() for name in next(csv.reader([header.rstrip('\r\n')],
                                                    delimiter=delimiter))]
    if bare and not names:
        raise ValueError(f'{path} has no line of names: its first line is {header.strip()!r}; put '
                         f'the {len(own)} names of the columns above it, such as t,voltage,'
                         'motor_position, or give them in a mapping file: names: [t, voltage, '
                         '...]')
    if bare and len(names) != len(own):
        raise ValueError(f'{path} has {len(own)} columns, and the mapping names {len(names)}: '
                         f'{list(names)}')
    columns = list(names) if bare else own
    twice = sorted({name for name in columns if columns.count(name) > 1})
    if twice:
        raise ValueError(f'{path}: columns {twice} are there twice')
    return columns, delimiter, {
        'read_options': arrow.ReadOptions(skip_rows=comments + (not bare), column_names=columns),
        'parse_options': arrow.ParseOptions(delimiter=delimiter),
        'convert_options': arrow.ConvertOptions(strings_can_be_null=True,
                                                decimal_point=_decimal(path, delimiter))}


def count_of_bare_columns(path: Path) -> int:
    """Return how many columns a file without a line of names has; 0 where it has names."""
    _, header, bare = _header(path)
    return len(header.split(delimiter_of(header))) if bare else 0


def delimiter_of(line: str) -> str:
    """Return what parts the columns of a line."""
    return max(';\t,|', key=line.count)


def is_number(text: str) -> bool:
    """Tell whether a text is a number, with a decimal point or a comma."""
    try:
        float(text.strip().strip('"').replace(',', '.'))
    except ValueError:
        return False
    return True


def _header(path: Path) -> tuple[int, str, bool]:
    """Return lines to skip, the first other line, and whether it holds numbers, not names."""
    comments = 0
    with path.open(encoding='utf-8-sig', errors='replace') as file:
        for header in file:
            if header.strip() and not header.startswith(('#', '%', '//')):
                cells = header.rstrip('\r\n').split(delimiter_of(header))
                return comments, header, all(is_number(cell) for cell in cells if cell.strip())
            comments += 1
    raise ValueError(f'{path} has no rows')


def _begin(path: Path) -> str:
    with path.open(encoding='utf-8-sig', errors='replace') as file:
        return file.read(BEGIN)


def _decimal(path: Path, delimiter: str) -> str:
    """Return the sign between whole and fraction: a comma where no number has a point."""
    if delimiter == ',':
        return '.'
    begin = _begin(path)
    commas = re.search(r'\d,\d', begin) is not None
    return ',' if commas and re.search(r'\d\.\d', begin) is None else '.'


def _hint(path: Path, delimiter: str) -> str:
    if delimiter == ',' and re.search(r'^-?\d+,\d+,-?\d+,\d+', _begin(path), re.MULTILINE):
        return ('; where commas are decimal the columns must be parted by semicolons or tabs: '
                'export it again so')
    if delimiter == ',' and re.search(r'\t|  ', _begin(path)) and ',' not in _begin(path)[:200]:
        return '; part the columns by commas, semicolons or tabs'
    return ''
