"""How a table of text is laid out: its letters, separators, and lines of names and units."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
import csv
from dataclasses import dataclass
from pathlib import Path
import re

from .column_names import looks_like, split
from .export_headers import period_without_times, refuse_logs, scope_names, unit_labels
from .number_texts import is_number
from .text_encoding import LINE_END, text_of
from .unit_symbols import CountsError, parsed, UnitError

TEXTS = ('.csv', '.txt', '.tsv', '.dat', '.asc', '.log', '.lvm', '.prn')
"""How names of tables of text end."""

_LAST = 50  # lines before the last, which may break off, by which the columns are told
_EMPTY = ' \t\r\n;,|'  # a line of these alone is a row of empty cells
_BLANKS = ' '  # any number of them parts columns
_OF_R = _BLANKS + '\t'
_DELIMITERS = '\t;|,' + _BLANKS  # of two that part lines alike, the first
MARKS = re.compile(r'\s*(#|%|//|;(?=[^;]*$))')
_QUOTED = re.compile('"([^"]*)"')
_UNIT_BEHIND = re.compile(r'(?<=\S)[ \t]+([\[(][^\[\]()\d]*[\])])(?=\s|$)')
"""A unit in brackets that a blank parts from its name: u [V], torque [N m]."""
_THOUSANDS = re.compile(r'[-+]?[1-9]\d{0,2}(,\d{3})+')
"""A number in quotes whose commas may part thousands."""
_TIMED = dict.fromkeys(('s', 'ms', 'us', 'ns', 'sec'), 'time')
"""What a column is called that has one of these units and no name."""


@dataclass(frozen=True)
class Layout:
    """
    What parts a table of text.

    ``skipped`` lines stand above the numbers. ``names`` are those of the file, and ``bare`` says
    that it has none: they are the numbers of the first row then. ``remark``: they stand behind
    the mark of a comment. ``decimal`` is the sign between whole and fraction. ``row`` is the
    first line of numbers, ``above`` the line over it, '' where there is none. ``unused`` are names
    of columns that the rows do not have. ``period``, s, is that of rows without times, else 0.
    """

    encoding: str
    delimiter: str
    decimal: str
    skipped: int
    names: tuple[str, ...]
    bare: bool
    remark: bool
    row: str
    above: str
    unused: tuple[str, ...]
    period: float

    @property
    def blanks(self) -> bool:
        """Whether any number of blanks parts the columns."""
        return self.delimiter == _BLANKS


@dataclass(frozen=True)
class _Columns:
    """
    What parts the lines, into how many cells, and which of them hold numbers in most lines.

    ``begun``: something stands in the first cell of most lines.
    """

    delimiter: str
    count: int
    numbers: tuple[int, ...]
    decimal: str
    begun: bool

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line."""
        return cells_of(line, self.delimiter)

    def has_row(self, line: str) -> bool:
        """Tell whether a line is a row of numbers, some of which may be missing."""
        cells = self.cells(line)
        if len(cells) != self.count or not self.numbers:
            return False
        told = [cells[k] for k in self.numbers if cells[k]]
        known = sum(map(is_number, told))
        first = cells[self.numbers[0]]
        return 2 * known >= max(1, len(told)) and (not first or is_number(first))

    def header(self, line: str) -> list[str]:
        """
        Return what a line above the rows says of each column; [] where it is none of that.

        R and pandas leave out the name of the first column, where it numbers the rows.
        """
        cells = self.cells(line)
        while cells and not cells[-1]:
            del cells[-1]
        lacking = self.count - len(cells)
        if lacking == 1 and self.count - 1 in self.numbers and self.delimiter in _OF_R and all(
                cells) and any(map(looks_like, cells)):
            return ['', *cells]
        if lacking > 1 or lacking == 1 and self.count - 1 in self.numbers:
            return []
        return cells + [''] * lacking


def layout_of(path: Path) -> Layout:
    """
    Look at the begin of a file; raises ValueError for one that is binary or has no rows.

    The rows are the lines that part as most do and hold numbers where most do. The line of names
    is the one above them that tells the most columns apart. Other lines above them, lines that
    begin with #, %, // or ; and blank ones are skipped. Names that a comment right above the
    numbers holds count, and so do units in a line of their own.
    """
    encoding, begin = text_of(path)
    lines = LINE_END.split(begin)
    shown = [k for k, line in enumerate(lines) if line.strip(_EMPTY) and not MARKS.match(line)]
    if not shown:
        raise ValueError(f'{path} has no rows')
    refuse_logs(path, [lines[k] for k in shown])
    if not any(any(map(str.isdigit, lines[k])) for k in shown[1:]) and not is_number(
            lines[shown[0]].split()[0].strip(',;')):
        raise ValueError(f'{path} has no rows: below {lines[shown[0]].strip()!r} stands no '
                         'number')
    columns = _columns_of([lines[k] for k in (
        shown[-_LAST - 1:-1] if len(shown) > _LAST else shown)])
    rows = [columns.has_row(lines[k]) for k in shown]
    # below a key, as Length, numbers stand above the rows
    at = next((n for n, is_row in enumerate(rows) if is_row and (
        is_number(columns.cells(lines[shown[n]])[0] or '0') or columns.begun
        and all(rows[n:n + 2]))), 1)
    row = [*shown, shown[-1] + 1][at]
    lines.append('')
    above = [k for k, line in enumerate(lines[:row]) if line.strip(_EMPTY)]
    remark = MARKS.match(lines[above[-1]]) if above else None
    told = columns.cells(lines[above[-1]][remark.end():]) if remark else []
    if len(told) != columns.count or any(map(is_number, told)):
        told = []
    over = [lines[k] for k in shown[:at]]
    cells = [columns.cells(line) for line in over]
    names, units = scope_names(cells, columns.cells(lines[row]))
    names = _with_units(_numbered(names), units) or told or _names_in(columns, over)
    names = _with_units(names, unit_labels(cells, len(names)))
    return Layout(encoding, columns.delimiter, columns.decimal, row,
                  tuple((names or columns.cells(lines[row]))[:columns.count]), not names,
                  bool(told), lines[row], lines[above[-1]] if above else '',
                  tuple(names[columns.count:]), period_without_times(cells))


def cells_of(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, without the blanks around them."""
    if delimiter == _BLANKS:
        whole = _QUOTED.sub(lambda cell: cell[1].replace(' ', '\0'), line)
        if '[' in whole or '(' in whole:
            whole = _UNIT_BEHIND.sub(lambda unit: '\0' + unit[1].replace(' ', '\0'), whole)
        return [cell.replace('\0', ' ') for cell in whole.split()]
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


def _columns_of(lines: Sequence[str]) -> _Columns:
    """Return the columns of lines that are mostly rows: so parted that most cells are numbers."""
    found = {one: _numbers_of(lines, one) for one in _DELIMITERS}
    delimiter = max(found, key=lambda one: max(found[one].values()))
    if not any(found[delimiter].values()):
        delimiter = max(_DELIMITERS, key=lines[0].strip().count)
    count = max(found[delimiter], key=lambda one: found[delimiter][one])
    rows = [cells_of(line, delimiter) for line in lines]
    across = list(zip(*(cells for cells in rows if len(cells) == count), strict=True))
    numbers = [k for k, cells in enumerate(across) if any(map(is_number, cells)) and 2 * sum(
        map(is_number, cells)) >= sum(map(bool, cells))]
    shown = [cell for k in numbers for cell in across[k] if is_number(cell)]
    commas = any(',' in one and (delimiter != ',' or not _THOUSANDS.fullmatch(one))
                 for one in shown)
    return _Columns(delimiter, count, tuple(numbers),
                    ',' if commas and not any('.' in one for one in shown) else '.',
                    2 * sum(map(bool, across[0])) > len(across[0]))


def _numbers_of(lines: Sequence[str], delimiter: str) -> Counter[int]:
    """Return how many numbers stand in the lines of each number of cells."""
    found = Counter[int]()
    for line in lines:
        cells = cells_of(line, delimiter)
        found[len(cells)] += sum(map(is_number, cells))
    return found


def _names_in(columns: _Columns, above: Sequence[str]) -> list[str]:
    """Return the names in the lines right above the rows, with their units; [] without any."""
    found: list[list[str]] = []
    for line in reversed(above):
        cells = columns.header(line)
        if not cells:
            if not found and sum(map(bool, columns.cells(line))) == 1:
                continue  # a mark between names and numbers, as "trace_values"
            break
        found.append(cells)
    units = [cells for cells in found if _are_units(cells)]
    named = [cells for cells in found if cells not in units] or units[-1:]
    if not named:
        return []
    names = max(named, key=lambda cells: (
        len({one for one in cells if one and not is_number(one)}),
        sum(bool(split(one)[1]) or looks_like(one) != '' for one in cells if one)))
    unit = next((cells for cells in units if cells is not names), [])
    unit = [*map(_bracketless, unit), *[''] * (len(names) - len(unit))]
    return _with_units(_numbered(names), unit)


def _with_units(names: Sequence[str], units: Sequence[str]) -> list[str]:
    """Return names with their units behind them, but for those that have one."""
    return [f'{name or _TIMED.get(unit, "")} [{unit}]' if unit and (
        name or unit in _TIMED) and not re.search(r'[^\d\s(][\])]$', name) else name
            for name, unit in zip(names, units, strict=False)]


def _numbered(names: Sequence[str]) -> list[str]:
    """Return names with a number behind those that are there more than once."""
    seen = Counter[str]()
    told = []
    for name in names:
        seen[name] += 1
        told.append(f'{name} ({seen[name]})' if name and names.count(name) > 1 else name)
    return told


def _bracketless(unit: str) -> str:
    return unit.strip('[]() ').removeprefix('-')


def _are_units(cells: Sequence[str]) -> bool:
    """Tell whether a line holds units: no number, and at least half of what is there is one."""
    if any(is_number(cell) for cell in cells if cell):
        return False
    known = 0
    for cell in map(_bracketless, cells):
        try:
            known += bool(re.search(r'[^\W\d_]|[°%]', cell) and parsed(cell))
        except UnitError as problem:
            known += isinstance(problem, CountsError)
    return 0 < sum(map(bool, map(_bracketless, cells))) <= 2 * known
