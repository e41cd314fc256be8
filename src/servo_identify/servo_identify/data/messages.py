"""
Messages of any rosbag2 as a table: what a mapping file names, joined in time.

A source is ``TOPIC.field``, ``TOPIC.field.field`` or ``TOPIC.field[index]``. The index is a number
or a name that the message lists in ``name``, ``joint_names`` or ``interface_names``:
``/joint_states.position[elbow]``. ``TOPIC.stamp`` is the time in s: that of the header, or of the
receipt where there is no header or it is zero. The topic of the mapping's time gives the rows.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
import re
from typing import Any

import numpy as np

from .tables import Table

_NAMES = ('name', 'joint_names', 'interface_names')
_PART = re.compile(r'(\w+)|\[([^\]]+)\]|\.')


def holds_messages(path: Path) -> bool:
    """Tell whether a path is that of a rosbag2 folder."""
    return (path / 'metadata.yaml').is_file()


def read_messages(path: Path, sources: Collection[str], time: str, held: Collection[str]) -> Table:
    """
    Return the table of ``sources``, with the rows of the topic of ``time``.

    Other topics are interpolated linearly; ``held`` sources keep their last value. Before the
    first message of its topic a source is NaN. Raises ValueError for a topic, field or name that
    is not there; the error says what is.
    """
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import get_typestore, Stores

    wanted = sorted({*sources, time})
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
            topics = sorted(reader.topics)
            plans = {source: _split(path, source, topics) for source in wanted}
            chosen = {topic for topic, _ in plans.values()}
            stamps: dict[str, list[int]] = {topic: [] for topic in chosen}
            values: dict[str, list[float]] = {source: [] for source in wanted}
            connections = [c for c in reader.connections if c.topic in chosen]
            for connection, received, raw in reader.messages(connections):
                message = reader.deserialize(raw, connection.msgtype)
                stamps[connection.topic].append(_stamp(message, received))
                for source, (topic, parts) in plans.items():
                    if topic == connection.topic and parts != ['stamp']:
                        values[source].append(_value(path, source, message, parts))
    except (ValueError, OSError):
        raise
    except Exception as error:  # AnyReaderError, and of a damaged file what the libraries say
        raise ValueError(f'{path} cannot be read as a rosbag2: '
                         f'{error or type(error).__name__}') from None
    return _joined(path, plans, stamps, values, time, held)


def _split(path: Path, source: str, topics: list[str]) -> tuple[str, list[str]]:
    """Return topic and field parts of a source."""
    topic = max((t for t in topics if source.startswith(f'{t}.')), key=len, default=None)
    if topic is None:
        raise ValueError(f'{path}: {source!r} names no topic of the bag; topics are {topics}')
    return topic, [m[1] or m[2] for m in _PART.finditer(source[len(topic) + 1:]) if m[1] or m[2]]


def _stamp(message: Any, received: int) -> int:
    """Return the time of a message in ns: of its header where that is set."""
    header = getattr(message, 'header', None)
    stamp = getattr(header, 'stamp', None)
    if stamp is None or not (stamp.sec or stamp.nanosec):
        return received
    return stamp.sec * 10**9 + stamp.nanosec


def _value(path: Path, source: str, message: Any, parts: list[str]) -> float:
    """Return the number of a message that a source names."""
    at, seen = message, [message]
    for part in parts:
        if hasattr(at, '__len__') and not isinstance(at, str):
            at = _element(path, source, at, part, seen)
        elif hasattr(at, part):
            at = getattr(at, part)
        else:
            fields = [n for n in getattr(at, '__dataclass_fields__', {}) if n != '__msgtype__']
            raise ValueError(f'{path}: {source}: there is no {part!r}; there are {fields}')
        seen.append(at)
    try:
        return float(at)
    except (TypeError, ValueError):
        raise ValueError(f'{path}: {source} is no number; give a field or an index of '
                         f'{type(at).__name__}') from None


def _element(path: Path, source: str, row: Any, which: str, seen: list[Any]) -> Any:
    index = int(which) if which.isdigit() else None
    named: list[str] = []
    for owner in reversed(seen):
        names = [n for key in _NAMES for n in getattr(owner, key, ())]
        named += names
        if index is None and which in names:
            index = names.index(which)
    if index is None:
        raise ValueError(f'{path}: {source}: there is no {which!r}; names are {named}')
    if index >= len(row):
        return np.nan  # a message may leave its row empty
    return row[index]


def _joined(path: Path, plans: dict[str, tuple[str, list[str]]], stamps: dict[str, list[int]],
            values: dict[str, list[float]], time: str, held: Collection[str]) -> Table:
    leading = plans[time][0]
    if not stamps[leading]:
        raise ValueError(f'{path}: there is no message on {leading}')
    zero = stamps[leading][0]
    times = {topic: np.array(those, dtype=np.int64) - zero for topic, those in stamps.items()}
    rows = times[leading] * 1e-9
    columns = {}
    for source, (topic, parts) in plans.items():
        if parts == ['stamp']:
            columns[source] = rows
        elif topic == leading:
            columns[source] = np.array(values[source])
        else:
            columns[source] = _at(rows, times[topic] * 1e-9, np.array(values[source]),
                                  source in held)
    return Table(path, columns)


def _at(rows: np.ndarray, times: np.ndarray, values: np.ndarray, held: bool) -> np.ndarray:
    """Return values of another topic at the times of the rows; NaN before its first message."""
    if not len(times):
        return np.full(len(rows), np.nan)
    order = np.argsort(times, kind='stable')
    times, values = times[order], values[order]
    if held:
        last = np.searchsorted(times, rows, 'right') - 1
        return np.where(last < 0, np.nan, values[np.maximum(last, 0)])
    return np.interp(rows, times, values, left=np.nan, right=np.nan)
