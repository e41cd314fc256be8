"""Lines above the numbers as known programs write them: the Scope of TwinCAT, LabVIEW, Rigol."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
import re

_SIGNS = ('Starttime of export', 'SampleTime[ms]')
"""How a line begins that this program alone writes."""
_FRAME = re.compile(r'\s*(?:\(\d+\.\d+\)\s+\w+\s+[0-9A-Fa-f]{3,8}#|'
                    r'\d+\.\d+\s+\w+\s+[0-9A-Fa-f]+x?\s+[RT]x\s+[dr]\s)')
"""How candump and the tools of Vector (ASC) write a frame of a CAN bus."""
_LABELLED = re.compile(r'\s*[A-Za-z]\w*: *[-+.\de]+(?:[,;\t ]+[A-Za-z]\w*: *[-+.\de]+)+\s*')
"""A line as the plotter of Arduino reads it: u:1.00,i:0.1."""
_IN_CELLS = re.compile(r'(?!\s*"?0x)\s*"?[-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)? ?[^\W\d_]\w*"?\s*')
"""A number with its unit in one cell: 2.65 V."""
_LOOKED_AT = 40  # lines, by which a print of messages is told
_FIELD = re.compile(r'-?-?-|\}|(?:- )*[A-Za-z_]\w*(?: ?\{|:(?: .*|$))|- .+|\.\.\.')
"""A line of a message that was printed: a field and its value, the end of one, an element."""
_NOTHING = ('', '(None)', 'None')
_UNIT_KEYS = ('Unit', 'Units', 'Einheit', 'Einheiten', 'Unité', 'Unidad', 'Unità')
"""How the line of units begins, in the languages of a program."""
LEAST_STAMP, MOST_STAMP = 1e17, 2e17
"""Counts of 100 ns since 1601 (FILETIME) from 1917 to 2234, and nothing else that a rig has."""


def scope_names(lines: Sequence[Sequence[str]], row: Sequence[str]) -> tuple[list[str], list[str]]:
    """
    Return the names of the columns and their units; [] where no key is above the numbers.

    ``lines`` are the cells of each line above the numbers, ``row`` those of the first line of
    numbers. A line begins with its key, which stands above each column of times again: ``Name``,
    ``SymbolName``, ``Unit``. A channel has the name that it has in the Scope, or that of its
    symbol where two have one name. Times are in ms, or stamps in 100 ns.
    """
    if not any(cells and cells[0] in _SIGNS for cells in lines) and not _keys_repeat(lines, row):
        return _behind_keys(lines, row)
    said = {cells[0]: cells for cells in lines if cells}
    names = list(said.get('Name', ()))[:len(row)]
    if len(names) < len(row):
        return [], []
    times = [k for k, name in enumerate(names) if name == 'Name']
    channels = [name for name in names if name != 'Name']
    symbols = list(said.get('SymbolName', ()))
    if len(set(channels)) < len(channels) and len(symbols) >= len(row):
        names = symbols[:len(row)]
    units = [*_units(said), *[''] * len(row)][:len(row)]
    units = ['' if unit in _NOTHING else unit for unit in units]
    for k in times:
        names[k] = 'time'
        units[k] = '100 ns' if is_stamp(row[k]) else 'ms'
    return names, units


def _keys_repeat(lines: Sequence[Sequence[str]], row: Sequence[str]) -> bool:
    """Tell whether keys stand above each of several columns of times: in lines of two keys."""
    places = {cells[0]: tuple(k for k, cell in enumerate(cells) if cell == cells[0])
              for cells in lines if len(cells) == len(row) and cells[0]}
    at = places.get('Name', ())
    return len(at) > 1 and list(places.values()).count(at) > 1


def _units(said: Mapping[str, Sequence[str]]) -> Sequence[str]:
    """Return the line of units, with its key; () where there is none."""
    return next((said[key] for key in _UNIT_KEYS if key in said), ())


def _behind_keys(lines: Sequence[Sequence[str]], row: Sequence[str]
                 ) -> tuple[list[str], list[str]]:
    """Return names and units that stand behind keys, above rows that begin with an empty cell."""
    said = {cells[0]: list(cells) for cells in lines if len(cells) == len(row)}
    if 'Vertical Units' in said and lines[-1] and lines[-1][0].upper() == 'TIME':
        return _of_tektronix(said, list(lines[-1]))
    names = said.get('Channel') or said.get('Channel Name') or said.get('Name')
    if not names or row[0]:
        return [], []
    units = _units(said) or [''] * len(row)
    return ['', *names[1:]], ['', *units[1:len(names)]]


def _of_tektronix(said: Mapping[str, list[str]], names: list[str]) -> tuple[list[str], list[str]]:
    """Return names and units of an oscilloscope; a channel has its label, where it has one."""
    labels = said.get('Label') or said.get('Labels') or [''] * len(names)
    called = [label or name for label, name in zip(labels[1:], names[1:], strict=False)]
    return [names[0], *called], ['s', *said['Vertical Units'][1:]]


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


def refuse_logs(path: Path, lines: Sequence[str]) -> None:
    """Raise ValueError for lines that are a log of something else than columns."""
    last = lines[:-1][-3:]  # of a whole file the very last may break off
    if last and all(map(_FRAME.match, last)):
        raise ValueError(f'{path} is a log of CAN frames, whose bytes are no columns: decode it '
                         'by the DBC of the drive into a table with a column for each signal, as '
                         'by can.LogReader and cantools (Database.decode_message)')
    if _is_print(lines):
        raise ValueError(f'{path} is a print of messages, as `ros2 topic echo` and `gz topic` '
                         'make it: record a bag of the topics (`ros2 bag record`), and give that')
    if last and all(map(_LABELLED.fullmatch, last)):
        raise ValueError(f'{path} has a name before each number, as {last[-1].strip()!r}: write '
                         'the names once, in a line above the numbers, and numbers alone below '
                         "them; sed -E 's/[^,;\\t ]+: *//g' takes the names off")
    if last and any(_has_units(last, sign) for sign in ',;\t'):
        raise ValueError(f'{path} has a unit behind each number, as {last[-1].strip()!r}: write '
                         'numbers alone, and the unit once behind the name: current [mA]')


def _is_print(lines: Sequence[str]) -> bool:
    """Tell whether lines are fields of messages, one below the other, in braces or indented."""
    shown = [line.strip() for line in lines[:_LOOKED_AT]]
    fields = [bool(_FIELD.fullmatch(line)) for line in shown]
    return len(shown) > 5 and all(fields) and any(
        line.endswith((':', '{')) for line in shown)


def _has_units(lines: Sequence[str], sign: str) -> bool:
    """Tell whether most cells of lines that a sign parts are a number with a unit."""
    cells = [cell for line in lines for cell in line.split(sign)]
    return len(cells) > len(lines) and 2 * sum(
        map(bool, map(_IN_CELLS.fullmatch, cells))) > len(cells)
