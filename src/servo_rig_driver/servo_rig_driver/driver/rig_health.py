"""
What is wrong with the rig, since when, and what has been counted.

Pure logic: instants are integers in ns, handed in. The I/O thread writes, the node reads.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from threading import Lock

AHEAD = 1_000_000_000
"""ns by which an event may lie ahead of now: what noted it has a clock of its own."""


class Level(IntEnum):
    """How bad it is; the numbers are those of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True)
class Trouble:
    """
    One thing that is, or was, wrong.

    ``until`` is None as long as it lasts. ``fades`` is the instant at which a passing event, such
    as a refused message, is no longer told; None for a state that lasts until it is over.
    """

    key: str
    level: Level
    text: str
    since: int
    until: int | None = None
    fades: int | None = None


class RigHealth:
    """
    The list of troubles by key, the last ones that passed, and counters.

    A trouble keeps its ``since`` as long as it lasts, also when its text changes.
    """

    def __init__(self, remembered: int = 8) -> None:
        self._troubles: dict[str, Trouble] = {}
        self._past: deque[Trouble] = deque(maxlen=remembered)
        self._counters: Counter[str] = Counter()
        self._lock = Lock()
        self.changes = 0

    def trouble(self, key: str, text: str, now: int, level: Level = Level.ERROR) -> None:
        """Say that something is wrong; saying it again changes text and level, not ``since``."""
        self._note(key, text, now, level, None)

    def event(self, key: str, text: str, now: int, level: Level = Level.WARN,
              lasts: float = 5.0) -> None:
        """Say that something happened; it is told for ``lasts`` seconds and counted by its key."""
        self.count(key)
        self._note(key, text, now, level, now + int(lasts * 1e9))

    def _note(self, key: str, text: str, now: int, level: Level, fades: int | None) -> None:
        with self._lock:
            known = self._troubles.get(key)
            since = now if known is None else known.since
            self._troubles[key] = Trouble(key, level, text, since, fades=fades)
            self.changes += known is None or (known.text, known.level) != (text, level)

    def fade(self, now: int) -> None:
        """End the events that have been told long enough, or lie ahead: time was set back."""
        for trouble in list(self._troubles.values()):
            if trouble.fades is not None and not trouble.since - AHEAD < now < trouble.fades:
                self.over(trouble.key, now)

    def over(self, key: str, now: int) -> None:
        """Say that a trouble has passed; one that is not there is none."""
        with self._lock:
            known = self._troubles.pop(key, None)
            if known is not None:
                self._past.append(replace(known, until=now))
                self.changes += 1

    def over_all(self, prefix: str, now: int) -> None:
        """Say that every trouble whose key begins with ``prefix`` has passed."""
        for key in [key for key in list(self._troubles) if key.startswith(prefix)]:
            self.over(key, now)

    def keep(self, prefix: str, troubles: Mapping[str, tuple[Level, str]], now: int) -> None:
        """
        Say all that is wrong by now under ``prefix``: level and text by the rest of the key.

        What is there under it and not among them has passed.
        """
        for key in [key for key in list(self._troubles) if key.startswith(prefix)]:
            if key.removeprefix(prefix) not in troubles:
                self.over(key, now)
        for key, (level, text) in troubles.items():
            self.trouble(prefix + key, text, now, level)

    def has(self, key: str) -> bool:
        """Whether a trouble lasts."""
        return key in self._troubles

    def count(self, counter: str, number: int = 1) -> None:
        """Add to a counter."""
        self._counters[counter] += number

    def counted(self, counter: str) -> int:
        """Return a counter, 0 when it was never touched."""
        return self._counters[counter]

    @property
    def counters(self) -> dict[str, int]:
        """All counters by name, a copy."""
        return dict(self._counters)

    @property
    def troubles(self) -> tuple[Trouble, ...]:
        """What lasts, the worst and then the oldest first."""
        with self._lock:
            lasting = list(self._troubles.values())
        return tuple(sorted(lasting, key=lambda t: (-t.level, t.since)))

    @property
    def past(self) -> tuple[Trouble, ...]:
        """The last troubles that passed, the latest first."""
        with self._lock:
            return tuple(reversed(self._past))

    @property
    def level(self) -> Level:
        """The worst level of what lasts."""
        return max((trouble.level for trouble in self.troubles), default=Level.OK)


class Heartbeats:
    """Who was heard last when: CiA 301 heartbeats of the nodes of the rig."""

    PRE_OPERATIONAL = 0x7F
    OPERATIONAL = 0x05
    STOPPED = 0x04
    BOOT_UP = 0x00
    WORDS = {PRE_OPERATIONAL: 'pre-operational', OPERATIONAL: 'operational', STOPPED: 'stopped',
             BOOT_UP: 'boot-up'}

    def __init__(self, nodes: dict[int, str], timeout: float) -> None:
        self.nodes = nodes
        self.timeout = timeout
        self.heard: dict[int, int] = {}
        self.state: dict[int, int] = {}

    def expect(self, now: int) -> None:
        """Begin to wait for every node: none is late before ``timeout`` from now on."""
        self.heard = dict.fromkeys(self.nodes, now)
        self.state = {}

    def beat(self, node: int, state: int, now: int) -> None:
        """Take a heartbeat; the toggle bit of old node guarding is ignored."""
        self.heard[node] = now
        self.state[node] = state & 0x7F

    def late(self, now: int) -> list[int]:
        """Return the nodes whose last heartbeat is older than ``timeout`` seconds."""
        return [node for node in self.nodes
                if now - self.heard.get(node, 0) > self.timeout * 1e9]

    def all_in(self, state: int) -> bool:
        """Whether every node told this state last."""
        return all(self.state.get(node) == state for node in self.nodes)
