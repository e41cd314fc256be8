"""Tells the health of the rig on /diagnostics, and what is new in it in the log and as events."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from servo_twin_msgs.msg import Event

from .message_conversion import GROUPS, to_diagnostics, to_time
from .rig_health import Level, RigHealth


class Diagnoser:
    """
    Publishes the health of a rig every ``period`` s, and at once when it changes.

    ``facts`` returns what else is to be told, as text by name; ``groups`` are the parts that have
    a status each. /diagnostics is an absolute name by the custom of ROS: one viewer sees all rigs,
    told apart by the name of the node.
    """

    def __init__(self, node: Node, health: RigHealth, facts: Callable[[], dict[str, str]],
                 groups: tuple[str, ...] = GROUPS) -> None:
        self.node = node
        self.groups = groups
        self.health = health
        self.facts = facts
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._events = node.create_publisher(Event, 'events', QoSProfile(
            depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self._changes = -1
        self._told_at = 0.0  # s of the steady clock: ROS time may be set, or stand still
        self._troubles: dict[str, str] = {}

    def look(self, now: int, period: float) -> None:
        """Tell what there is to tell at ``now`` ns of ROS time."""
        self.health.fade(now)
        if self.health.changes != self._changes or monotonic() - self._told_at >= period:
            self.tell(now)

    def tell(self, now: int) -> None:
        """Publish the health, and log what is new."""
        self._told_at = monotonic()
        self._changes = self.health.changes
        lasting = {trouble.key: trouble for trouble in self.health.troubles}
        log = self.node.get_logger()
        for key, trouble in lasting.items():
            if self._troubles.get(key) == trouble.text:
                continue
            self._happened('trouble', key, trouble.text, now)
            if trouble.level is Level.ERROR:  # rclpy wants one line for each severity
                log.error(trouble.text)
            else:
                log.warning(trouble.text)
        for key in self._troubles.keys() - lasting.keys():
            log.info(f'over: {self._troubles[key]}')
            self._happened('over', key, self._troubles[key], now)
        self._troubles = {key: trouble.text for key, trouble in lasting.items()}
        self._publisher.publish(to_diagnostics(self.node.get_fully_qualified_name(), self.health,
                                               self.facts(), now, self.groups))

    def _happened(self, kind: str, key: str, text: str, now: int) -> None:
        event = Event(source=self.node.get_fully_qualified_name(), kind=kind, text=text,
                      content=key)
        event.header.stamp = to_time(now)
        self._events.publish(event)

    def say_goodbye(self, now: int) -> None:
        """Tell once more and wait until that has arrived."""
        self.tell(now)
        self._publisher.wait_for_all_acked(Duration(seconds=1.0))
