"""
Mapping files: how the columns of somebody else's file become those of a recording.

A mapping is YAML. ``time`` and every entry of ``columns`` takes one ``source`` of the file through
these steps, in this order, each of which may be left out::

    source: load         the file's own column; or value: 0.0 for a constant one
                         (of the time alone, every: 0.002 counts the rows, s from one to the next)
    above: 32767         where the value is above this,
    subtract: 65536      subtract this (signed numbers read as unsigned)
    plus: fine           add another column of the file, in the same numbers; or minus: load
    wraps: 360           a turn of the numbers: where the encoder wraps around; undone here
    scale: 0.00113       multiply
    offset: 0.0          add
    times: input_volts   multiply by another column of the file
    unit: deg            what the numbers are in by now, brought to SI; 1/4096 rev is one count
    negate: true
    zero: first          subtract the first value, or the mean (incremental encoders)
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from servo_twin.description.nearest_name import or_what
from servo_twin.description.strict_yaml import NotPlain, read_yaml
from servo_twin.physics.servo import Servo

from .column_names import NAMES
from .column_units import factor_of
from .joining import HELD, joined
from .table import Table
from .unsigned import check_signed
from .unwrapping import doubts, unwrapped

KEYS = {'rows': str, 'names': list, 'join': bool, 'time': dict, 'columns': dict,
        'recording': dict, 'period': (int, float), 'drive_on': str}
STEPS = {'source': str, 'value': (int, float), 'every': (int, float), 'above': (int, float),
         'subtract': (int, float), 'plus': str, 'minus': str, 'wraps': (int, float),
         'scale': (int, float), 'offset': (int, float), 'times': str, 'unit': str, 'negate': bool,
         'zero': str}
BESIDE = ('plus', 'minus', 'times')
"""Steps that take another column of the file."""
FACTS = {'family': str, 'replicate': int, 'note': str}
ZEROS = ('first', 'mean')


LEADING = ('motor_position', 'load_position')
"""The first of these that is mapped gives the rows where several topics are joined."""


@dataclass(frozen=True)
class Mapping:
    """
    A mapping file, checked.

    ``rows`` names the list of records in a JSON file or the sheet of a spreadsheet, ``names`` the
    columns of a text file that has no line of names; ``join`` says that each row belongs to one
    of several topics and leaves the columns of the others empty. ``period``, s, is the grid to
    resample to, 0 to take it from the times; ``drive_on`` names a column that is 0 while the
    drive is switched off; ``recording`` gives family, replicate and note, in which {name} stands
    for what the file says of it.
    """

    path: Path
    columns: dict[str, dict[str, Any]]
    rows: str = ''
    period: float = 0.0
    drive_on: str = ''
    recording: dict[str, Any] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    join: bool = False

    @property
    def time(self) -> tuple[str, str]:
        """The source of the time and the unit of its numbers; '' where steps change them."""
        steps = self.columns['t']
        plain = not {'scale', 'offset', 'times', 'plus', 'minus'} & steps.keys()
        return (steps.get('source', ''), steps.get('unit', '')) if plain else ('', '')

    def sources(self, *names: str) -> set[str]:
        """Return the sources of some columns, or of all, with what is read beside them."""
        steps = [taken for name, taken in self.columns.items() if not names or name in names]
        found = {one[key] for one in steps for key in ('source', *BESIDE) if key in one}
        return found | ({self.drive_on} if self.drive_on and not names else set())

    def apply(self, table: Table, servo: Servo | None,
              warnings: list[str]) -> dict[str, np.ndarray]:
        """
        Return the columns of a table.

        Raises ValueError for a source that it lacks, or whose negative numbers were read as
        unsigned. They are in m and N of what moves straight of the ``servo``.

        Where the drive is off its terminals are open, which a command of 0 V is not: there is no
        command there (NaN).
        """
        table = self._of_one_topic(table)
        for name, steps in self.columns.items():
            if 'source' in steps and not {'above', 'wraps'} & steps.keys():
                check_signed(table.path, name, steps['source'], table[steps['source']])
        columns = {name: _follow(table, steps, self._factor(name, servo))
                   for name, steps in self.columns.items()}
        for name, steps in self.columns.items():
            if 'wraps' in steps:
                warnings += doubts(name, columns['t'], table[steps['source']], steps['wraps'])
        if self.drive_on:
            off = np.flatnonzero(table[self.drive_on] == 0.0)
            if len(off):
                warnings.append(f'the drive is off in {len(off)} rows, the first is row '
                                f'{off[0] + 1}: they have no command')
                if 'voltage' in columns:
                    columns['voltage'] = np.array(columns['voltage'], dtype=float)
                    columns['voltage'][off] = np.nan
        return columns

    def _factor(self, name: str, servo: Servo | None) -> float:
        return factor_of(f'{self.path}: {name}', name, self.columns[name].get('unit', ''), servo)

    def _of_one_topic(self, table: Table) -> Table:
        time = self.columns['t'].get('source', '')
        if not (self.join or time == '__time'):  # the latter is PlotJuggler's
            return table
        if not time:
            raise ValueError(f"{self.path}: join: true needs a 'source' of the time: rows that "
                             'are counted are all of one topic')
        leading = next((self.columns[name]['source'] for name in LEADING
                        if 'source' in self.columns.get(name, {})), time)
        return joined(table, time, leading, self.sources(), self.sources(*HELD))

    def describe(self, table: Table) -> dict[str, Any]:
        """Return family, replicate and note of a table."""
        try:
            return {name: value.format(**table.facts) if isinstance(value, str) else value
                    for name, value in self.recording.items()}
        except (KeyError, IndexError) as error:
            raise ValueError(f'{self.path}: recording: {table.path} does not say {error}; it says '
                             f'{list(table.facts)}') from None


def read_mapping(path: Path) -> Mapping:
    """Read a mapping file; raises ValueError naming what is wrong in it."""
    try:
        content = read_yaml(path.read_text('utf8'))
    except NotPlain as error:
        raise ValueError(f'{path}: {error}') from None
    except UnicodeDecodeError as error:
        raise ValueError(f'{path} is no text: {error}') from None
    except yaml.YAMLError as error:
        raise ValueError(f'{path} is no YAML: {error}') from None
    if not isinstance(content, dict):
        raise ValueError(f'{path} is no mapping file: it has no keys {list(KEYS)}')
    _check(path, 'the file', content, KEYS)
    if 'time' not in content or not content.get('columns'):
        raise ValueError(f"{path}: 'time' and 'columns' must be there; there are {list(content)}")
    columns = {'t': content['time']} | content['columns']
    for name, steps in columns.items():
        _check_steps(path, name, steps)
    recording = content.get('recording', {})
    _check(path, 'recording', recording, {name: (str, int) for name in FACTS})
    return Mapping(path, columns, content.get('rows', ''), float(content.get('period', 0.0)),
                   content.get('drive_on', ''), recording,
                   tuple(str(one) for one in content.get('names', ())),
                   content.get('join', False))


def _kind(kinds: Any) -> str:
    """Return in words what a value is to be."""
    words = {bool: 'true or false', str: 'text', dict: 'mapping of names to values',
             list: 'list', int: 'whole number'}
    return 'number' if isinstance(kinds, tuple) and float in kinds else ' or '.join(
        words[one] for one in (kinds if isinstance(kinds, tuple) else (kinds,)))


def _check(path: Path, where: str, content: dict, known: dict[str, Any]) -> None:
    for key, value in content.items():
        if key not in known:
            raise ValueError(f'{path}: {where} has no {key!r}; '
                             f'{or_what(key, known, "it has")}')
        if not isinstance(value, known[key]) or (
                isinstance(value, bool) and known[key] is not bool):
            raise ValueError(f'{path}: {where}: {key} = {value!r} is no {_kind(known[key])}')
        if isinstance(value, (int, float)) and not abs(value) < 1e300:  # also NaN
            raise ValueError(f'{path}: {where}: {key} = {value!r} is no finite number')


def _check_steps(path: Path, name: str, steps: Any) -> None:
    if name not in NAMES:
        raise ValueError(f'{path}: there is no column {name!r}; '
                         f'{or_what(name, NAMES, "columns are")}')
    if not isinstance(steps, dict):
        raise ValueError(f'{path}: {name}: {steps!r} is no set of steps; known are {list(STEPS)}')
    _check(path, name, steps, STEPS)
    if sum(one in steps for one in ('source', 'value', 'every')) != 1:
        raise ValueError(f"{path}: {name}: give either 'source' or 'value'"
                         + (", or 'every' for rows without times" if name == 't' else ''))
    if 'every' in steps and (name != 't' or not steps['every'] > 0.0):
        raise ValueError(f"{path}: {name}: every = {steps['every']!r}: it is the s from row to "
                         'row of the time, more than 0')
    if ('above' in steps) != ('subtract' in steps):
        raise ValueError(f"{path}: {name}: 'above' and 'subtract' go together")
    if not steps.get('wraps', 1.0) > 0.0:
        raise ValueError(f'{path}: {name}: wraps = {steps["wraps"]!r}, it must be more than 0')
    if steps.get('zero', 'first') not in ZEROS:
        raise ValueError(f'{path}: {name}: zero = {steps["zero"]!r}; known are {list(ZEROS)}')


def _follow(table: Table, steps: dict[str, Any], factor: float) -> np.ndarray:
    rows = len(next(iter(table.columns.values())))
    if 'every' in steps:
        return float(steps['every']) * np.arange(rows)
    if 'value' in steps:
        column = np.full(rows, float(steps['value']))
    else:
        column = _signed(table[steps['source']], steps)
    for step, sign in (('plus', 1.0), ('minus', -1.0)):
        if step in steps:
            column = column + sign * _signed(table[steps[step]], steps)
    if 'wraps' in steps:
        column = unwrapped(column, steps['wraps'])
    column = column * steps.get('scale', 1.0) + steps.get('offset', 0.0)
    if 'times' in steps:
        column = column * table[steps['times']]
    if factor != 1.0:
        column = column * factor
    if steps.get('negate'):
        column = -column
    known = column[np.isfinite(column)]
    if 'zero' in steps and len(known):
        column = column - (known[0] if steps['zero'] == 'first' else np.mean(known))
    return column


def _signed(column: np.ndarray, steps: dict[str, Any]) -> np.ndarray:
    """Return numbers that were read as unsigned with their signs."""
    if 'above' not in steps:
        return column
    return np.where(column > steps['above'], column - steps['subtract'], column)
