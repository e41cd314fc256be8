"""Who commands the rig: no motor follows two sources of commands."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.subscription import Subscription

from .rig_health import RigHealth

KEY = 'command.sources'


class CommandSources:
    """
    Counts those who publish to a subscription, and tells the health where they are several.

    The subscription counts who can reach it, so a publisher of another QoS does not matter. One
    that was killed counts until ROS gives it up, 20 s by default.
    """

    def __init__(self, node: Node, subscription: Subscription, health: RigHealth) -> None:
        self._node, self._subscription, self._health = node, subscription, health

    def several(self, now: int) -> bool:
        """Look who is there at ``now``, ns; return whether they are too many."""
        count = self._subscription.get_publisher_count()
        if count < 2:
            self._health.over(KEY, now)
            return False
        names = sorted(f'{one.node_namespace.rstrip("/")}/{one.node_name}'
                       for one in self._node.get_publishers_info_by_topic(
                           self._subscription.topic_name))
        self._health.trouble(
            KEY, f'{count} publishers on command, of {names}: no set-point is taken and the motor '
            'is at zero until one alone is left; one that was killed counts for up to 20 s', now)
        return True
