"""
Messages of any file as a table: what a mapping file names, joined in time.

A source is ``TOPIC.field``, ``TOPIC.field.field`` or ``TOPIC.field[index]``. The index is a number
or a name that the message lists in ``name``, ``joint_names`` or ``interface_names``:
``/joint_states.position[elbow]``. A message without this name holds no number of it. One without
any of the names is left out, for other nodes may publish joints of their own on the topic.

``TOPIC.stamp`` is the time in s (:mod:`.message_times`). The topic of the mapping's time gives the
rows.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
import re
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from servo_twin.description.nearest_name import or_what

from .begins import date_of
from .message_files import opened
from .message_parts import fields_in, LACKING, part_of
from .message_times import on_one_clock, stamp_of
from .rows_in_time import at_rows, period_between
from .table import Table

NAMELESS = 'the message lists no names: write a number in place of {!r}, 0 for the first'
_NAMES = ('name', 'names', 'joint_names', 'interface_names')
_PART = re.compile(r'(\w+)|\[([^\]]+)\]|\.')
LOOKED = 200  # messages in which the fields of a file are sought
_DEEPEST, _LONGEST = 6, 32  # of fields within fields, of rows whose elements are listed


class _NotListed(ValueError):
    """A name that a message does not list."""


class Numbers(Protocol):
    """A column that grows number by number: an array, or a file."""

    def append(self, number: Any, /) -> None:
        """Take the next number."""
        ...


Column = TypeVar('Column', bound=Numbers)


@dataclass(frozen=True)
class Taken(Generic[Column]):
    """
    What was taken of the messages of a file, in their order.

    ``topic_of``: of each source, but for those that are a stamp; ``stamps`` and ``received``: of
    each topic, ns; ``leading``: the topic that gives the rows, from ``begin`` on.
    """

    path: Path
    leading: str
    topic_of: dict[str, str]
    stamps: dict[str, Column]
    received: dict[str, Column]
    values: dict[str, Column]
    begin: str

    def times(self, array_of: Callable[[Column], np.ndarray]
              ) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
        """Return the times of each topic, s from the first of the rows, and what to mind."""
        stamps, told = on_one_clock({topic: array_of(those) for topic, those in
                                     self.stamps.items()},
                                    {topic: array_of(those) for topic, those in
                                     self.received.items()}, self.leading)
        zero = stamps[self.leading].min()
        return {topic: (those - zero) * 1e-9 for topic, those in stamps.items()}, told

    def table(self, rows: np.ndarray, value_of: Callable[[str, str], np.ndarray],
              warnings: tuple[str, ...]) -> Table:
        """Return sources at the times of rows, s; ``value_of(source, topic)`` gives one."""
        return Table(self.path, {source: value_of(source, topic) if topic else rows
                                 for source, topic in self.topic_of.items()}, warnings=warnings,
                     begins={one: self.begin for one, of in self.topic_of.items() if not of})


def taken(path: Path, sources: Collection[str], time: str, new: Callable[[str], Column]
          ) -> Taken[Column]:
    """
    Take ``sources`` out of the messages; ``new`` makes a column of an array's type code.

    Raises ValueError for a topic, field or name that is not there; the error says what is.
    """
    wanted = sorted({*sources, time})
    with opened(path) as file:
        topics = sorted(file.topics)
        plans = {source: _split(path, source, topics) for source in wanted}
        of_topic: dict[str, list[tuple[str, list[str]]]] = {}
        for source, (topic, parts) in plans.items():
            of_topic.setdefault(topic, []).append((source, parts))
        stamps, received = ({topic: new('q') for topic in of_topic} for _ in range(2))
        values, begins = {source: new('d') for source in wanted}, dict[str, int]()
        empty, never, listed = set(of_topic), dict[str, ValueError](), set[str]()
        for message in file.messages(of_topic):
            empty.discard(message.topic)
            numbers, lacking = dict[str, float](), dict[str, ValueError]()
            for source, parts in of_topic[message.topic]:
                if parts == ['stamp']:
                    continue
                try:
                    numbers[source] = _value(path, source, message.content, parts)
                except _NotListed as problem:
                    numbers[source], lacking[source] = np.nan, problem
            never = lacking | never
            if numbers and len(lacking) == len(numbers):
                continue  # of another node, which publishes other joints on the same topic
            listed.update(numbers.keys() - lacking.keys())
            stamps[message.topic].append(stamp := stamp_of(message.content))
            received[message.topic].append(at := message.received)
            begins.setdefault(message.topic, stamp or at)
            for source, number in numbers.items():
                values[source].append(number)
    leading = plans[time][0]
    if leading in empty:
        raise ValueError(f'{path}: there is no message on {leading}')
    for source, why in never.items():
        if source not in listed:
            raise why
    topic_of = {one: '' if parts == ['stamp'] else at for one, (at, parts) in plans.items()}
    return Taken(path, leading, topic_of, stamps, received, values,
                 date_of(float(begins.get(leading, 0)), 'ns'))


def read_messages(path: Path, sources: Collection[str], time: str, held: Collection[str]) -> Table:
    """
    Return the table of ``sources``, with the rows of the topic of ``time``.

    Other topics are interpolated linearly; ``held`` sources hold theirs till the next. Before the
    first message of its topic a source is NaN. Raises ValueError as :func:`taken` does.
    """
    found = taken(path, sources, time, array)
    times, told = found.times(lambda column: np.array(column, dtype=np.int64))
    order = np.argsort(times[found.leading], kind='stable')
    rows = times[found.leading][order]

    def value_of(source: str, topic: str) -> np.ndarray:
        values = np.array(found.values[source])
        if topic == found.leading:
            return np.asarray(values[order])
        return at_rows(rows, times[topic], values, period_between(rows) * (source in held))

    return found.table(rows, value_of, told)


def fields_of(path: Path) -> dict[str, str]:
    """
    Return all numbers of a file of messages, as sources, with the type of their message.

    Taken from the first message of each topic, and from all of the first LOOKED messages, as
    several nodes may publish joints of their own; ``TOPIC.stamp`` is the first of each.
    """
    with opened(path) as file:
        found, waiting = dict[str, str](), set(file.topics)
        for count, message in enumerate(file.messages(waiting.copy()), 1):
            if message.topic in waiting or count <= LOOKED:
                waiting.discard(message.topic)
                found.setdefault(f'{message.topic}.stamp', message.kind)
                for field in _numbers(message.content, [message.content]):
                    found.setdefault(message.topic + field, message.kind)
            if not waiting and count >= LOOKED:
                break
    return found


def _numbers(at: Any, owners: list[Any]) -> Iterator[str]:
    """Yield what follows the topic in the sources of all numbers of a message."""
    if isinstance(at, (bool, int, float, np.number)):
        yield ''
    elif isinstance(at, (str, bytes)) or len(owners) > _DEEPEST:
        return
    elif hasattr(at, '__len__') and not isinstance(at, dict):
        named = _listed(owners)
        for k in range(min(len(at), _LONGEST)):
            index = named[k] if len(named) == len(at) else str(k)
            yield from (f'[{index}]{rest}' for rest in _numbers(at[k], [*owners, at[k]]))
    else:
        for name in fields_in(at):
            part = part_of(at, name)
            if name != 'header' and 'data_offset' not in fields_in(part):  # the layout of an array
                yield from (f'.{name}{rest}' for rest in _numbers(part, [*owners, part]))


def _split(path: Path, source: str, topics: list[str]) -> tuple[str, list[str]]:
    """Return topic and field parts of a source."""
    topic = max((t for t in topics if source.startswith((f'{t}.', f'{t}['))), key=len,
                default=None)
    if topic is None:
        raise ValueError(f'{path}: {source!r} names no topic of the file; '
                         f'{or_what(source.partition(".")[0], topics, "topics are")}')
    return topic, [m[1] or m[2] for m in _PART.finditer(source[len(topic):]) if m[1] or m[2]]


def _value(path: Path, source: str, message: Any, parts: list[str]) -> float:
    """Return the number of a message that a source names."""
    at, seen = message, [message]
    for part in parts:
        if hasattr(at, '__len__') and not isinstance(at, (str, dict)):
            at = _element(path, source, at, part, seen)
        else:
            inner = part_of(at, part)
            if inner is LACKING:
                raise ValueError(f'{path}: {source}: there is no {part!r}; '
                                 f'{or_what(part, fields_in(at))}')
            at = inner
        seen.append(at)
    try:
        return np.nan if at is None else float(at)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f'{path}: {source} is no number; give a field or an index of '
                         f'{type(at).__name__}') from None


def _listed(owners: list[Any]) -> list[str]:
    """Return the names that the nearest owner lists for the elements of its rows."""
    for owner in reversed(owners):
        for key in _NAMES:
            names = part_of(owner, key, None)
            if names is not None and not isinstance(names, str) and len(names):
                return [str(name) for name in names]
    return []


def _element(path: Path, source: str, row: Any, which: str, seen: list[Any]) -> Any:
    index, named = None, list[str]()
    for owner in reversed(seen):
        names = _listed([owner])
        named += names
        if index is None and which in names:
            index = names.index(which)
    if index is None and which.isdigit():
        index = int(which)
    if index is None:
        known = or_what(which, named, 'names are') if named else NAMELESS.format(which)
        raise _NotListed(f'{path}: {source}: there is no {which!r}; {known}')
    if index >= len(row):
        return np.nan  # a message may leave its row empty
    return row[index]
