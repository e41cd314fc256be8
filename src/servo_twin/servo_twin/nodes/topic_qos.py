"""The quality of service of sample topics, which a user may override by parameters."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

OVERRIDABLE = QoSOverridingOptions.with_default_policies()
"""Lets parameters such as ``qos_overrides./rig/encoder.subscription.depth`` override a profile."""


EVENTS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Of the topic `events`: who comes late still gets what happened."""


def sample_qos() -> QoSProfile:
    """
    Return the QoS of a topic of samples: reliable, and deep enough for seconds of them.

    A profile for each topic: ROS writes into it what it is overridden with.
    """
    return QoSProfile(depth=5000, history=HistoryPolicy.KEEP_LAST,
                      reliability=ReliabilityPolicy.RELIABLE)
