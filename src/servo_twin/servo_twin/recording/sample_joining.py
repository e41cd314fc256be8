"""Joins what the topics of a rig say of the same samples: by sequence number, never by arrival."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic, TypeVar

Message = TypeVar('Message')
_ROOM = 5000  # blocks that may wait for another topic


class Joiner(Generic[Message]):
    """
    Joins the messages of several topics that carry the same running number.

    Each topic comes in its own order. When a number is complete, every topic is past all smaller
    ones, so what still waits with a smaller number has lost a part and is given up: ``given_up``
    counts. A topic whose numbers go back has begun again: what waited of it is forgotten.
    """

    def __init__(self, topics: Sequence[str]) -> None:
        self.topics = tuple(topics)
        self.given_up = 0
        self.last: dict[str, int] = {}
        """Last running number of each topic that was heard."""
        self._waiting: dict[int, dict[str, Message]] = {}

    def put(self, topic: str, sequence: int, message: Message) -> dict[str, Message] | None:
        """Take a message; return all topics' messages of its number when they are complete."""
        if sequence <= self.last.get(topic, -1):
            for parts in self._waiting.values():
                parts.pop(topic, None)
            self._waiting = {number: parts for number, parts in self._waiting.items() if parts}
        self.last[topic] = sequence
        parts = self._waiting.setdefault(sequence, {})
        parts[topic] = message
        if len(parts) == len(self.topics):
            del self._waiting[sequence]
            self._give_up([number for number in self._waiting if number < sequence])
            return parts
        if len(self._waiting) > _ROOM:
            self._give_up([min(self._waiting)])
        return None

    def silent(self) -> tuple[str, ...]:
        """Name the topics that were never heard."""
        return tuple(topic for topic in self.topics if topic not in self.last)

    def _give_up(self, numbers: list[int]) -> None:
        for number in numbers:
            del self._waiting[number]
        self.given_up += len(numbers)
