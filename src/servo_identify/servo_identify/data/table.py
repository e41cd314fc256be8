"""A table as its file has it: names and numbers, not yet anybody's units."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
import re
from typing import Any

import numpy as np

from servo_twin.description.nearest_name import or_what

from .arrow_columns import first_stamp, is_clock, numbers_of, zero_of
from .cell_parts import parts_of
from .clock_times import seconds_of
from .long_form import check_wide
from .missing_texts import without_missing
from .number_texts import is_hexadecimal, plain, without_groups
from .rows_in_turn import check_turns
from .run_labels import COLUMN, numbered

_GROUPED = re.compile(r"[-+]?\d{1,3}(?:([.,'\u2019 ])\d{3})(?:\1\d{3})*(?!\1)[.,]\d+")
_PANDAS = '__index_level_0__'  # the index of a frame that has no name
_SIGNS = ('; write no sign between thousands, and one decimal sign in all of the file: 1081.6, or '
          '1081,6 where semicolons or tabs part the columns')
"""Why a number with a comma or an apostrophe is none."""
_AGAIN = '; the line of names stands there again: a second recording begins, cut the file there'
LONGEST = 40
"""Letters of a cell that a message shows."""
_HEX = '; are these hexadecimal? Write them as decimal numbers, or with 0x in front'
_LISTED = ('; each cell holds a list: make a file of each record, or columns of its lists, such '
           'as pandas.DataFrame(record).to_csv(NAME)')
_EMPTY = '; leave the cell empty where nothing was measured'
_ARROW = ' -> '
_SERIAL = ('; the monitor of a serial port wrote its own stamps in front: cut all up to '
           "' -> ' off, or log without them")


@dataclass(frozen=True)
class Table:
    """
    A file's columns, float64 of shape (rows,), under the file's own names.

    ``facts`` holds what the file says once: numbers and texts beside the columns. ``refused``
    says of columns that hold text why they are no numbers; whoever asks for one is told.
    ``warnings`` say what was left out of the file. ``zeros`` is what was taken off whole numbers
    that float64 cannot hold, stamps of a clock: their first, by column. ``begins`` is the first
    stamp of a calendar or a clock as the file shows it, by column. ``run`` is the name of this
    recording in a file of several.
    """

    path: Path
    columns: dict[str, np.ndarray]
    facts: dict[str, Any] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    zeros: dict[str, int] = field(default_factory=dict)
    begins: dict[str, str] = field(default_factory=dict)
    run: str = ''

    def __post_init__(self) -> None:
        lengths = {name: len(column) for name, column in self.columns.items()}
        if len(set(lengths.values())) > 1:
            raise ValueError(f'{self.path}: columns of different lengths, in rows: {lengths}')

    def __getitem__(self, name: str) -> np.ndarray:
        if name in self.refused:
            raise ValueError(self.refused[name])
        if name not in self.columns:
            raise ValueError(f'{self.path} has no column {name!r}; '
                             f'{or_what(name, self.columns, "it has")}')
        return self.columns[name]

    def first(self, name: str) -> float:
        """Return the first number of a column as it stands in the file; 0 of one without any."""
        known = self.columns.get(name, np.empty(0))
        known = known[np.isfinite(known)]
        return float(known[0]) + self.zeros.get(name, 0) if len(known) else 0.0


def from_arrow(path: Path, found: Any, warnings: tuple[str, ...] = ()) -> Table:
    """Return an Arrow table as a table; ``warnings`` are what was said of the file so far."""
    columns, texts, zeros = dict[str, np.ndarray](), {}, dict[str, int]()
    begins = dict[str, str]()
    for named, column in zip(found.column_names, found.columns, strict=True):
        name = '' if named == _PANDAS else named
        zero = zero_of(column, next(iter(zeros.values()), 0))
        if zero:
            zeros[name] = zero
        numbers = numbers_of(column, zero)
        if numbers is None:
            texts[name] = column.to_pylist()
        elif name or not _is_no_column(numbers):
            name = name or _index(columns, is_clock(column))
            columns[name] = numbers
            if begin := first_stamp(column):
                begins[name] = begin
    return with_texts(Table(path, columns, warnings=warnings, zeros=zeros, begins=begins), texts)


def _index(columns: dict[str, np.ndarray], clock: bool) -> str:
    """Return what a column without a name is called: pandas writes the index of a frame so."""
    return 'time' if clock and not {'t', 'time'} & set(columns) else 'index'


def _is_no_column(numbers: np.ndarray) -> bool:
    """Tell whether a column without a name is none: empty, or a count of the rows."""
    return not np.isfinite(numbers).any() or np.array_equal(numbers, np.arange(len(numbers)))


def with_texts(table: Table, texts: dict[str, list[Any]]) -> Table:
    """
    Add columns that may be text: numbers or times of a clock, else the reason why not.

    Texts that can be no number are NaN in a column that has more numbers, with a warning.
    """
    labels, told = {}, list[str]()
    for name, cells in (part for held in texts.items() for part in parts_of(*held)):
        values, said = (cells, '') if COLUMN.fullmatch(name) else without_missing(name, cells)
        if said:
            labels[name] = cells
        try:
            clock = _clock(table.path, name, values)
            name = name or _index(table.columns, clock is not None)
            table.columns[name] = (_numbers(table.path, name, values) if clock is None else clock)
            told += [said] if said else []
            first = next((str(one).strip() for one in values if one), '')
            if clock is not None and ':' in first:  # no duration
                table.begins[name] = first
        except ValueError as problem:
            runs = numbered(name, cells)
            if runs is None:
                table.refused[name], labels[name] = str(problem), cells
            else:
                table.columns[name] = runs
    check_wide(table.path, table.columns, labels)
    check_turns(table.path, table.columns, labels)
    return replace(table, warnings=(*table.warnings, *told))


def _clock(path: Path, name: str, values: list[Any]) -> np.ndarray | None:
    try:
        return seconds_of(values)
    except ValueError as problem:
        raise ValueError(f'{path}: column {name!r} {problem}') from None


def _numbers(path: Path, name: str, values: list[Any]) -> np.ndarray:
    column = np.empty(len(values))
    values = without_groups(values)
    for k, value in enumerate(values):
        try:
            column[k] = np.nan if value is None else float(
                plain(value.strip()) if isinstance(value, str) else value)
        except (TypeError, ValueError, OverflowError):
            at = next((n for n, one in enumerate(values) if _GROUPED.fullmatch(str(one))), k)
            shown = str(values[at])
            why = _AGAIN if shown.strip() == name else _SERIAL if _ARROW in shown else (
                _SIGNS if re.search(r"\d[,'\u2019 ]\d", shown) else
                _EMPTY if shown.startswith('#') else
                _LISTED if isinstance(values[at], list | dict) or shown[:1] in '[(' else
                _HEX if is_hexadecimal(str(one).strip() for one in values) else
                _EMPTY if shown[:1].isalpha() else '')
            shown = shown if len(shown) <= LONGEST else f'{shown[:LONGEST]} ...'
            raise ValueError(f'{path}: column {name!r} has {shown!r} in row {at + 1}, which '
                             f'is no number{why}') from None
    return column


def without_empty(table: Table) -> dict[str, np.ndarray]:
    """Return columns without empty rows, as spreadsheets write them below and between rows."""
    known = np.any([~np.isnan(column) for column in table.columns.values()], axis=0)
    if np.all(known) or not np.any(known):
        return table.columns
    return {name: column[known] for name, column in table.columns.items()}
