"""The topics that another driver publishes: found, subscribed to as they are offered, heard."""

from __future__ import annotations

from collections.abc import Callable, Collection
from importlib import import_module
from inspect import Parameter, Signature
from time import monotonic
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription

from ..driver.rig_health import RigHealth

OVERRIDABLE = QoSOverridingOptions.with_default_policies()
Take = Callable[[str, Any, int | None], None]


class RobotTopics:
    """
    Subscribes to ``topics`` once they are published, and again where they come back otherwise.

    ``take`` gets the topic, each message, and its number among those of its publisher where the
    middleware tells it. What is not published, or was not heard for ``silence`` s, is told to the
    health; of all but the ``leading`` topic silence is usual, since others may come when they
    change only. ``kinds`` has the types of the topics that are subscribed to.
    """

    def __init__(self, node: Node, topics: Collection[str], leading: str, silence: float,
                 health: RigHealth, take: Take) -> None:
        self._node, self._health, self._give = node, health, take
        self._topics, self._leading, self._silence = tuple(topics), leading, silence
        self.kinds: dict[str, str] = {}
        self._inputs: dict[str, tuple[Subscription, QoSProfile]] = {}
        self._began = monotonic()
        self._heard: dict[str, float] = {}
        self._since: dict[str, float] = {}

    def look(self, now: int) -> None:
        """Subscribe to what is there by now, and tell what is not; ``now`` in ns."""
        there = dict(self._node.get_topic_names_and_types())
        for topic in self._topics:
            if topic not in self.kinds:
                self._find(topic, there, now)
            else:
                self._listen(topic, now)

    def publishers(self) -> dict[str, list[str]]:
        """
        Return the full names of those who publish each topic.

        A publisher that was started again may offer less than was asked for, or another type, and
        would never be heard. Its topic is subscribed to again, unless the user has asked for that
        QoS by a parameter.
        """
        found = {}
        for topic in list(self.kinds):
            infos = self._infos(topic)
            found[topic] = [f'{one.node_namespace.rstrip("/")}/{one.node_name}' for one in infos]
            subscription, asked = self._inputs[topic]
            less = falls_short(qos_of([one.qos_profile for one in infos]), asked)
            if infos and (less and not self._overridden(topic)
                          or self.kinds[topic] not in {one.topic_type for one in infos}):
                self._node.destroy_subscription(subscription)
                del self.kinds[topic], self._inputs[topic]
        return found

    def _overridden(self, topic: str) -> bool:
        begin = f'qos_overrides.{self._node.resolve_topic_name(topic)}.subscription.'
        return any(name.startswith(begin) for name in self._node._parameter_overrides)

    def _infos(self, topic: str) -> list[Any]:
        return self._node.get_publishers_info_by_topic(self._node.resolve_topic_name(topic))

    def _find(self, topic: str, there: dict[str, list[str]], now: int) -> None:
        name, infos = self._node.resolve_topic_name(topic), self._infos(topic)
        if not infos or name not in there:
            if monotonic() - self._began > self._silence:
                self._health.trouble(f'topics.{topic}', f'nobody publishes {name}', now)
            return
        kind = infos[0].topic_type
        package, group, word = kind.split('/')
        try:
            message = getattr(import_module(f'{package}.{group}'), word)
        except (ImportError, AttributeError):
            self._health.trouble(f'topics.{topic}', f'{name} is of {kind}, which is not '
                                 'installed here; source the workspace that has it', now)
            return
        asked = qos_of([one.qos_profile for one in infos])
        first = topic not in self._since  # ROS keeps its parameters as of the first subscription
        subscription = self._node.create_subscription(
            message, topic, self._taker(topic), asked, qos_overriding_options=(
                OVERRIDABLE if first or self._overridden(topic) else None))
        self._inputs[topic] = subscription, asked
        self.kinds[topic], self._since[topic] = kind, monotonic()

    def _taker(self, topic: str) -> Callable[..., None]:
        """
        Return a callback for messages with their numbers.

        rclpy gives the number to a callback that asks for two arguments, and its EventsExecutor
        hands them over as one.
        """
        def take(*told: Any) -> None:
            self._heard[topic] = monotonic()
            message, info = told[0] if len(told) == 1 else told
            self._give(topic, message, info.get('publication_sequence_number'))

        two = [Parameter(name, Parameter.POSITIONAL_ONLY) for name in ('message', 'info')]
        take.__signature__ = Signature(two)
        return take

    def _listen(self, topic: str, now: int) -> None:
        name = self._node.resolve_topic_name(topic)
        quiet = monotonic() - self._heard.get(topic, self._since[topic])
        if quiet <= self._silence:
            self._health.over(f'topics.{topic}', now)
        elif topic not in self._heard:
            self._health.trouble(f'topics.{topic}', f'no message of {name} has come', now)
        elif topic == self._leading:
            self._health.trouble(f'topics.{topic}', f'{name} is silent: no sample', now)


def qos_of(offered: list[QoSProfile]) -> QoSProfile:
    """Return the best that every publisher of a topic offers: reliable, with its last messages."""
    reliable = all(one.reliability == ReliabilityPolicy.RELIABLE for one in offered)
    latched = all(one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in offered)
    return QoSProfile(
        depth=1000, reliability=ReliabilityPolicy.RELIABLE if reliable
        else ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.TRANSIENT_LOCAL
        if latched else DurabilityPolicy.VOLATILE)


def falls_short(offered: QoSProfile, asked: QoSProfile) -> bool:
    """Return whether an offer is less than what was asked for: the two would never match."""
    return (asked.reliability == ReliabilityPolicy.RELIABLE != offered.reliability
            or asked.durability == DurabilityPolicy.TRANSIENT_LOCAL != offered.durability)
