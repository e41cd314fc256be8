"""Lines above the numbers as known programs write them: the Scope of TwinCAT, LabVIEW, Rigol."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
import re

_SIGNS = ('Starttime of export', 'SampleTime[ms]')
"""How a line begins that this program alone writes."""
_FRAME = re.compile(r'\s*(?:\(\d+\.\d+\)\s+\w+\s+[0-9A-Fa-f]{3,8}#|'
                    r'\d+\.\d+\s+\w+\s+[0-9A-Fa-f]+x?\s+[RT]x\s+[dr]\s)')
"""How candump and the tools of Vector (ASC) write a frame of a CAN bus."""
_NOTHING = ('', '(None)', 'None')
LEAST_STAMP, MOST_STAMP = 1e17, 2e17
"""Counts of 100 ns since 1601 (FILETIME) from 1917 to 2234, and nothing else that a rig has."""


def scope_names(lines: Sequence[Sequence[str]], row: Sequence[str]) -> tuple[list[str], list[str]]:
    """
    Return the names of the columns and their units; [] for a file of another program.

    ``lines`` are the cells of each line above the numbers, ``row`` those of the first line of
    numbers. A line begins with its key, which stands above each column of times again: ``Name``,
    ``SymbolName``, ``Unit``. A channel has the name that it has in the Scope, or that of its
    symbol where two have one name. Times are in ms, or stamps in 100 ns.
    """
    if not any(cells and cells[0] in _SIGNS for cells in lines):
        return [], []
    said = {cells[0]: cells for cells in lines if cells}
    names = list(said.get('Name', ()))[:len(row)]
    if len(names) < len(row):
        return [], []
    times = [k for k, name in enumerate(names) if name == 'Name']
    channels = [name for name in names if name != 'Name']
    symbols = list(said.get('SymbolName', ()))
    if len(set(channels)) < len(channels) and len(symbols) >= len(row):
        names = symbols[:len(row)]
    units = [*said.get('Unit', ()), *[''] * len(row)][:len(row)]
    units = ['' if unit in _NOTHING else unit for unit in units]
    for k in times:
        names[k] = 'time'
        units[k] = '100 ns' if is_stamp(row[k]) else 'ms'
    return names, units


def is_stamp(cell: str) -> bool:
    """Tell whether a cell is a count of 100 ns since 1601, as the clock of Windows has it."""
    return len(cell) == 18 and cell.isdecimal() and LEAST_STAMP < int(cell) < MOST_STAMP


def unit_labels(lines: Sequence[Sequence[str]], count: int) -> list[str]:
    """Return the units of so many columns that LabVIEW writes far above their names, or ''."""
    cells = next((one[1:] for one in lines if one[:1] == ['Y_Unit_Label']), [])
    return ['', *cells, *[''] * count][:count]


def period_without_times(lines: Sequence[Sequence[str]]) -> float:
    """
    Return the period, s, of a file without a column of times; 0 of any other.

    LabVIEW has it behind ``Delta_X``, an oscilloscope of Rigol below ``Increment``.
    """
    if any(cells[:2] == ['X_Columns', 'No'] for cells in lines):
        told = next((cells[1:] for cells in lines if cells[:1] == ['Delta_X']), [])
        return _positive(next(filter(None, told), '0'))
    for names, values in pairwise(lines):
        if 'Increment' in names[:len(values)] and values[:1] == ['Sequence']:
            return _positive(values[names.index('Increment')])
    return 0.0


def _positive(text: str) -> float:
    try:
        return max(0.0, float(text.replace(',', '.')))
    except ValueError:
        return 0.0


def are_frames(lines: Sequence[str]) -> bool:
    """Tell whether the last of some lines are frames of a CAN bus, whose bytes are no columns."""
    return bool(lines) and all(map(_FRAME.match, lines[-3:]))
