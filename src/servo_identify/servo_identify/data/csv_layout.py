"""How a table of text is laid out: its letters, separators, and lines of names and units."""

from __future__ import annotations

from collections.abc import Sequence
import csv
from dataclasses import dataclass
from pathlib import Path
import re

from .physical_units import parsed, UnitError

BEGIN = 100_000  # bytes that are looked at before a file is read
_MARKS = re.compile(r'\s*(#|%|//|;(?=[^;]*$))')
_BLANKS = ' '  # any number of them parts columns
_LINE_END = re.compile(r'\r\n|\n|\r')


@dataclass(frozen=True)
class Layout:
    """
    What parts a table of text.

    ``skipped`` lines stand above the numbers. ``names`` are those of the file, and ``bare`` says
    that it has none: they are the numbers of the first row then. ``remark``: they stand behind
    the mark of a comment. ``begin`` is the text that was looked at.
    """

    encoding: str
    delimiter: str
    skipped: int
    names: tuple[str, ...]
    bare: bool
    remark: bool
    first: str
    begin: str

    @property
    def decimal(self) -> str:
        """The sign between whole and fraction: a comma where no number has a point."""
        if self.delimiter == ',':
            return '.'
        commas = re.search(r'\d,\d', self.begin) is not None
        return ',' if commas and re.search(r'\d\.\d', self.begin) is None else '.'

    @property
    def blanks(self) -> bool:
        """Whether any number of blanks parts the columns."""
        return self.delimiter == _BLANKS


def layout_of(path: Path) -> Layout:
    """
    Look at the begin of a file; raises ValueError for one that is binary or has no rows.

    The line of names is the first that parts as the line below it does. Lines above it, lines
    that begin with #, %, // or ; and blank ones are skipped. Names that a comment right above the
    numbers holds count, and so do units in a line of their own below the names.
    """
    encoding, begin = _text(path)
    lines = _LINE_END.split(begin)
    shown = [k for k, line in enumerate(lines) if line.strip() and not _MARKS.match(line)]
    if not shown:
        raise ValueError(f'{path} has no rows')
    at = next((k for k in range(len(shown) - 1)
               if _alike(lines[shown[k]], lines[shown[k + 1]])), 0)
    line = lines[shown[at]]
    delimiter = delimiter_of(line)
    names, skipped = _cells(line, delimiter), shown[at] + 1
    bare = all(is_number(cell) for cell in names if cell)
    remark = False
    if bare:
        skipped -= 1
        above = [one for one in lines[:skipped] if one.strip()]
        mark = _MARKS.match(above[-1]) if above else None
        told = _cells(above[-1][mark.end():], delimiter) if mark else []
        if mark and len(told) == len(names) and not any(map(is_number, told)):
            names, bare, remark = told, False, True
    elif at + 1 < len(shown):
        units = _cells(lines[shown[at + 1]], delimiter)
        if _are_units(units) and len(units) == len(names):
            skipped = shown[at + 1] + 1
            names = [f'{name} [{unit}]' if unit and not re.search(r'[\])]$', name) else name
                     for name, unit in zip(names, map(_bracketless, units), strict=True)]
    return Layout(encoding, delimiter, skipped, tuple(names), bare, remark, line, begin)


def delimiter_of(line: str) -> str:
    """Return what parts the columns of a line."""
    best = max(';\t,|', key=line.count)
    return best if best in line or len(line.split()) < 2 else _BLANKS


def is_number(text: str) -> bool:
    """Tell whether a text is a number, with a decimal point or a comma."""
    try:
        float(text.strip().strip('"').replace(',', '.'))
    except ValueError:
        return False
    return True


def _text(path: Path) -> tuple[str, str]:
    """Return the encoding of a file, and how it begins."""
    with path.open('rb') as file:
        begin = file.read(BEGIN)
    if begin[:2] in (b'\xff\xfe', b'\xfe\xff'):
        encoding = 'utf-16'
    elif b'\0' in begin:
        raise ValueError(f'{path} is no table of text: it holds bytes that are no letters; export '
                         'it as CSV')
    else:
        encoding = 'utf-8-sig'
    try:
        return encoding, begin.decode(encoding)
    except UnicodeDecodeError as problem:
        if encoding == 'utf-8-sig' and problem.start < len(begin) - 4:  # not cut inside a letter
            encoding = 'latin-1'
        return encoding, begin.decode(encoding, 'ignore')


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == _BLANKS:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


def _alike(line: str, below: str) -> bool:
    """Tell whether two lines have as many columns, of which there are several."""
    delimiter = delimiter_of(line)
    return len(_cells(line, delimiter)) == len(_cells(below, delimiter)) > 1


def _bracketless(unit: str) -> str:
    return unit.strip('[]() ').removeprefix('-')


def _are_units(cells: Sequence[str]) -> bool:
    """Tell whether a line holds units: no number, and more than nothing that is a unit."""
    if any(is_number(cell) for cell in cells if cell):
        return False
    known = 0
    for cell in map(_bracketless, cells):
        try:
            known += bool(cell and parsed(cell))
        except UnitError as problem:
            known += 'counts' in str(problem)
    return known > 0


def last_line(path: Path, encoding: str) -> str:
    """Return the last line of a file that is not blank, '' where there is none."""
    with path.open('rb') as file:
        file.seek(max(0, path.stat().st_size - BEGIN))
        lines = _LINE_END.split(file.read().decode(encoding, 'ignore'))
    return next((one for one in reversed(lines) if one.strip()), '')
