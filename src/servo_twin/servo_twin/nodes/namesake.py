"""One name, one node: of two processes that run a node of the same name the later one ends."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, UTC
from os import getpid
from socket import gethostname
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

PROCESS = 'process'
STALE, STALE_HERE = 60.0, 5.0  # s, of another machine with a clock of its own; of this one
SILENT = 3.0  # s in which one that runs is heard: its reports come every second


class Namesake:
    """
    Listens on /diagnostics for another process that runs a node of the same full name.

    Two nodes of one name would be one to everybody else: both follow the same commands, and their
    samples and answers mix. The one that began later gives way: ``then`` is called once with a
    sentence. ``process`` is when this process began, its machine, its id, and the time now; the
    node tells it among its facts as :data:`PROCESS`. A process that was killed says nothing, so
    that the next one can begin at once. What was told more than STALE s ago, such as a bag that is
    played, says nothing; on this machine STALE_HERE s, as the bag may be new.
    All times are of the day, since ROS time may be that of a simulation.
    """

    def __init__(self, node: Node, then: Callable[[str], None]) -> None:
        self._begun = f'{_now()} {gethostname()} {getpid()}'
        self._node, self._then = node, then
        self._told = False
        self._began = monotonic()
        self._seen_from: float | None = None
        node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 100)

    @property
    def process(self) -> str:
        """Who this is, told now."""
        return f'{self._begun} {_now()}'

    def alone(self, looked: float) -> bool:
        """
        Tell whether no other of this name runs; not before this one has looked for so long, s.

        One that was killed stays in the graph for 20 s, but is not heard.
        """
        own = self._node.get_name(), self._node.get_namespace()
        if self._node.get_node_names_and_namespaces().count(own) < 2:
            return monotonic() >= self._began + looked
        if self._seen_from is None:
            self._seen_from = monotonic()
        return monotonic() > self._seen_from + SILENT

    def _hear(self, message: DiagnosticArray) -> None:
        name = self._node.get_fully_qualified_name()
        for status in message.status:
            told = next((one.value for one in status.values if one.key == PROCESS), '')
            process, _, now = told.rpartition(' ')
            if (not self._told and status.name.partition(':')[0] == name
                    and process < self._begun and _lately(process, now)):
                self._told = True
                self._then(f'another {name} runs (begun {process}): this one gives way; choose '
                           'another namespace, or end the other one')


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec='microseconds')


def _lately(process: str, told: str) -> bool:
    stale = STALE_HERE if process.split()[1:2] == [gethostname()] else STALE
    try:
        return abs((datetime.now(UTC) - datetime.fromisoformat(told)).total_seconds()) < stale
    except (ValueError, TypeError):  # no time, or one without a zone
        return False
