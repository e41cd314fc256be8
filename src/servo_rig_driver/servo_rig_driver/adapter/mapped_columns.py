"""
Mapping files, as `servo-identify import` takes them, for messages that come one by one.

A mapping is YAML. ``time`` names the topic whose messages make the samples. Each entry of
``columns`` takes one ``source`` through these steps, each of which may be left out::

    source: /joint_states.effort[hip]     or value: 0.0 for a constant one
    above: 32767         where the value is above this,
    subtract: 65536      subtract this (signed numbers read as unsigned)
    scale: 0.00113       multiply
    offset: 0.0          add
    negate: true
    zero: first          subtract the first value (incremental encoders)

What needs the whole recording (``zero: mean``), another column (``times``) or a table (``rows``,
``drive_on``) is refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import Any

import yaml

from ..driver.sample_blocks import COLUMNS
from ..plain_yaml import read_yaml
from .message_field import Field, FieldError, STAMP

_STEPS = {'source': str, 'value': (int, float), 'above': (int, float), 'subtract': (int, float),
          'scale': (int, float), 'offset': (int, float), 'negate': bool, 'zero': str}
SHORTEST = 5e-5
"""Period of samples in s, of 20 kHz: a shorter one makes more than anything here can take."""
HELD = frozenset(('voltage', 'current_reference', 'reference_velocity', 'reference_position',
                  'external_torque'))
"""Commands: they hold from their message to the next; what is measured is interpolated."""


class MappingError(ValueError):
    """A mapping file that cannot be used; the text names the file, the entry and the choice."""


@dataclass(frozen=True)
class Column:
    """One column of the samples: where its numbers come from and what is done to them."""

    name: str
    field: Field
    above: float | None = None
    subtract: float = 0.0
    scale: float = 1.0
    offset: float = 0.0
    from_first: bool = False

    def of(self, message: Any) -> float:
        """Return the column's value in SI units, NaN for none. Raises FieldError; see Field.of."""
        value = self.field.of(message)
        if not isfinite(value):
            return nan
        if self.above is not None and value > self.above:
            value -= self.subtract
        return value * self.scale + self.offset


@dataclass(frozen=True)
class MappedColumns:
    """
    A mapping file, read: the topic that makes the samples, the columns, constant ones apart.

    ``period``, s, is that of the samples; 0 to take it from the messages.
    """

    leading: str
    columns: tuple[Column, ...]
    constants: dict[str, float]
    period: float = 0.0

    @property
    def topics(self) -> dict[str, tuple[Column, ...]]:
        """The topics by name, each with the columns that come from it; the leading one first."""
        found: dict[str, list[Column]] = {self.leading: []}
        for column in self.columns:
            found.setdefault(column.field.topic, []).append(column)
        return {topic: tuple(columns) for topic, columns in found.items()}


def read_mapping(path: Path, joint: str = '') -> MappedColumns:
    """
    Read a mapping file; ``[joint]`` in a source stands for the name of the joint.

    Raises MappingError naming what is wrong in it, such as a joint that has no name.
    """
    try:
        content = read_yaml(path.read_text('utf8'))
    except OSError as error:
        raise MappingError(f'{path}: cannot be read: {error.strerror}') from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise MappingError(f'{path} is no YAML: {error}') from None
    if not isinstance(content, dict) or not isinstance(content.get('columns'), dict) or (
            not isinstance(content.get('time'), dict)):
        raise MappingError(f"{path}: 'time' and 'columns' must be there")
    refused = [key for key in ('rows', 'drive_on', 'names', 'join') if key in content]
    if refused:
        raise MappingError(f'{path}: {refused} are of tables, and there are messages here')
    time = _field(path, 't', content['time'].get('source', ''), joint)
    if time.parts[-1] not in (STAMP, 'sec', 'nanosec'):
        raise MappingError(f'{path}: time: {time.source} is no time of a message; write '
                           f'{time.topic}.{STAMP}')
    columns, constants = [], {}
    for name, steps in content['columns'].items():
        _check(path, name, steps)
        sign = -1.0 if steps.get('negate') else 1.0
        if 'value' in steps:
            constants[name] = sign * (steps['value'] * steps.get('scale', 1.0)
                                      + steps.get('offset', 0.0))
            continue
        columns.append(Column(
            name, _field(path, name, steps['source'], joint), steps.get('above'),
            steps.get('subtract', 0.0), sign * steps.get('scale', 1.0),
            sign * steps.get('offset', 0.0), 'zero' in steps))
    if not columns:
        raise MappingError(f'{path}: no column comes from a topic')
    period = content.get('period', 0.0)
    if type(period) not in (int, float) or period and not SHORTEST <= period <= 1.0:
        raise MappingError(f'{path}: period = {period!r} s is outside [{SHORTEST:g}, 1]; leave it '
                           'out to take that of the messages')
    return MappedColumns(time.topic, tuple(columns), constants, float(period))


def _field(path: Path, name: str, source: str, joint: str) -> Field:
    if '[joint]' in source and not joint:
        raise MappingError(f"{path}: {name}: {source} is of one joint; its name is the parameter "
                           "'joint', such as -p joint:=hip")
    try:
        return Field(source.replace('[joint]', f'[{joint}]'))
    except FieldError as error:
        raise MappingError(f'{path}: {name}: {error}') from None


def _check(path: Path, name: str, steps: Any) -> None:
    if name not in COLUMNS:
        raise MappingError(f'{path}: there is no column {name!r}; columns are {list(COLUMNS)}')
    if not isinstance(steps, dict):
        raise MappingError(f'{path}: {name}: {steps!r} is no set of steps; known are '
                           f'{list(_STEPS)}')
    for key, value in steps.items():
        if key not in _STEPS:
            raise MappingError(f'{path}: {name} has no {key!r} here; it has {list(_STEPS)}')
        if not isinstance(value, _STEPS[key]) or (
                isinstance(value, bool) and _STEPS[key] is not bool) or (
                isinstance(value, float) and not isfinite(value)):
            raise MappingError(f'{path}: {name}: {key} = {value!r} is of the wrong kind')
    if ('source' in steps) == ('value' in steps):
        raise MappingError(f"{path}: {name}: give either 'source' or 'value'")
    if ('above' in steps) != ('subtract' in steps):
        raise MappingError(f"{path}: {name}: 'above' and 'subtract' go together")
    if steps.get('zero', 'first') != 'first':
        raise MappingError(f'{path}: {name}: zero = {steps["zero"]!r} needs the whole recording; '
                           "live there is 'first'")
