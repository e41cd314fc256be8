"""What a node was told at its start under a name that it does not have; the rig has its own."""

from __future__ import annotations

from rclpy.node import Node

from ..description.nearest_name import or_what

LATER = 'qos_overrides.'
"""Begins the names that a node declares with its publishers and subscriptions."""


class UnknownParameter(ValueError):
    """A parameter was given at the start that the node does not have."""


def refuse_unknown(node: Node) -> None:
    """
    Raise UnknownParameter for what was given at the start and is not declared by now.

    A node cannot see who a value was meant for: ``-p`` and a launch file reach it as ``/**`` of a
    file does. A file for several nodes therefore gives each its own part, as ``/**/twin:``.
    """
    declared = sorted(node._parameters)
    for name in sorted(node._parameter_overrides):
        if name not in declared and not name.startswith(LATER):
            raise UnknownParameter(
                f'{node.get_name()} has no parameter {name!r}, which was given at its start; '
                f'{or_what(name, declared)}. In a file for several nodes, write it below the '
                'node that has it')
