"""Topics that several nodes publish: what they say is mixed. The twin has its own."""

from __future__ import annotations

from collections.abc import Iterable

from rclpy.node import Node

UNKNOWN = '_NODE_NAME_UNKNOWN_'
"""What ROS calls a node that it has not heard of yet."""


def mixed(node: Node, topics: Iterable[str]) -> str:
    """
    Return in words which topics nodes of different names publish; empty where none.

    A topic is named fully or as the node names it. Of two nodes of one name the later one ends
    (namesake.py), and one that was killed counts on.
    """
    found = [f'{topic} is published by {names}' for topic in topics
             if len(names := _publishers(node, topic)) > 1]
    return (f'{", ".join(found)}: what they say is mixed; end all but one, or give each a '
            'namespace of its own') if found else ''


def _publishers(node: Node, topic: str) -> list[str]:
    infos = node.get_publishers_info_by_topic(node.resolve_topic_name(topic))
    return sorted({f'{one.node_namespace.rstrip("/")}/{one.node_name}' for one in infos
                   if one.node_name != UNKNOWN})
