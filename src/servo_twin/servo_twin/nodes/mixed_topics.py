"""Topics of one rig that several nodes publish: what they say is mixed, and nobody can tell it."""

from __future__ import annotations

from collections.abc import Iterable

from rclpy.node import Node

UNKNOWN = '_NODE_NAME_UNKNOWN_'
"""What ROS calls a node that it has not heard of yet."""


def mixed(node: Node, topics: Iterable[str]) -> str:
    """
    Return in words which topics nodes of different names publish; empty where none.

    Of two nodes of one name the later one ends (namesake.py), and one that was killed counts on.
    """
    told = []
    for topic in topics:
        names = {f'{one.node_namespace.rstrip("/")}/{one.node_name}'
                 for one in node.get_publishers_info_by_topic(node.resolve_topic_name(topic))
                 if one.node_name != UNKNOWN}
        if len(names) > 1:
            told.append(f'{topic} is published by {sorted(names)}')
    return (f'{", ".join(told)}: what they say is mixed; end all but one, or give each a '
            'namespace of its own') if told else ''
