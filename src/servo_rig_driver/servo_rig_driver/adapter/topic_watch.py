"""What came of one topic from one report to the next, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan

from ..driver.rig_health import Level
from .mapped_columns import Column
from .message_field import FieldError, OtherName


class TopicWatch:
    """
    Counts the messages of a topic and the numbers in them.

    Several nodes may publish one topic, each its own joints. Then some messages lack the field,
    and that is as it should be while others have it. Those that have it are of one publisher while
    their numbers rise.
    """

    def __init__(self, columns: Sequence[Column]) -> None:
        self._columns = tuple(columns)
        self._numbers = [0] * len(columns)
        self._taken = 0
        self._lacking, self._other = '', False
        self._number: int | None = None
        self._back = 0  # how often a number did not rise

    def take(self, row: Sequence[float], number: int | None = None) -> None:
        """Note a message: the values of the topic's columns, its number of its publisher."""
        self._taken += 1
        if number is not None:
            self._back += self._number is not None and number <= self._number
            self._number = number
        for place, value in enumerate(row):
            self._numbers[place] += not isnan(value)

    def lacks(self, error: FieldError) -> None:
        """Note a message without a field that the mapping names."""
        self._lacking = str(error)
        self._other |= isinstance(error, OtherName)

    def report(self, publishers: Sequence[str]) -> dict[str, tuple[Level, str]]:
        """
        Return (level, sentence) by key of what is wrong since the last report.

        ``publishers`` are the full names of the nodes that publish the topic now. Nothing is
        returned of a report in which no message came.
        """
        found = {}
        if self._lacking and (self._other or not self._taken):
            found['field'] = Level.ERROR, self._lacking
        for column, numbers in zip(self._columns, self._numbers, strict=True):
            if self._taken and not numbers:
                found[column.name] = Level.ERROR, (
                    f'{column.name}: {column.field.source} holds no number, it is not finite '
                    'or its list is empty; does the robot measure it?')
            elif numbers < self._taken:
                found[column.name] = Level.WARN, (
                    f'{column.name}: {column.field.source} holds no number in '
                    f'{self._taken - numbers} of {self._taken} messages')
        if self._back > 1 or (self._number is None and self._taken and not self._lacking
                              and len(publishers) > 1):
            found['several'] = Level.WARN, (
                f'{len(publishers)} publishers, of {sorted(publishers)}, and not one alone has '
                'what the mapping names: their values are mixed; leave one, or remap its topic')
        self._back = 0
        self._numbers, self._taken = [0] * len(self._columns), 0
        self._lacking, self._other = '', False
        return found
