"""Messages of a long file as a table, part by part: decoded once, and kept on disk meanwhile."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager, ExitStack
from functools import partial
from pathlib import Path
import tempfile

import numpy as np

from .messages import Taken, taken
from .on_disk import OnDisk
from .rows_in_time import at_rows, period_between
from .table import Table


class NotInOrder(Exception):
    """Messages whose stamps run backwards: all of them are to be held to sort them."""


class LongMessages:
    """The messages of a file as the table of :func:`~.messages.read_messages`, in parts."""

    def __init__(self, found: Taken[OnDisk], held: Collection[str]) -> None:
        self._found, self._held = found, held
        self._times, self._told = found.times(OnDisk.part)
        if any((np.diff(those) < 0.0).any() for those in self._times.values()):
            raise NotInOrder
        self._usual = {topic: period_between(those) for topic, those in self._times.items()}

    def tables(self, rows: int) -> Iterator[Table]:
        """Yield all rows, so many at once."""
        leading = self._times[self._found.leading]
        for first in range(0, len(leading), rows):
            at = leading[first:first + rows]
            yield self._found.table(at, partial(self._value_of, first, at), self._told)

    def _value_of(self, first: int, at: np.ndarray, source: str, topic: str) -> np.ndarray:
        column = self._found.values[source]
        if topic == self._found.leading:
            return column.part(first, len(at))
        times = self._times[topic]
        begin = max(int(np.searchsorted(times, at[0], 'right')) - 1, 0)
        ahead = self._usual[self._found.leading] if source in self._held else 0.0
        end = int(np.searchsorted(times, at[-1] + ahead, 'right')) + 1
        return at_rows(at, times[begin:end], column.part(begin, end - begin),
                       ahead, self._usual[topic])


@contextmanager
def long_messages(path: Path, sources: Collection[str], time: str, held: Collection[str],
                  folder: Path) -> Iterator[LongMessages]:
    """
    Give the messages of a file; ``folder`` has room for 8 bytes for each number and stamp.

    Raises NotInOrder, and ValueError as :func:`~.messages.taken` does.
    """
    with ExitStack() as files:
        def new(code: str) -> OnDisk:
            return OnDisk(files.enter_context(tempfile.TemporaryFile(dir=folder)), code)

        yield LongMessages(taken(path, sources, time, new), held)
