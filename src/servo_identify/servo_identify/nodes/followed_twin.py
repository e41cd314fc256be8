"""Which twin node the identify node follows, and whether another one runs in its place."""

from __future__ import annotations

from time import monotonic

from rclpy.node import Node

from servo_twin.recording.events import BEGAN, PARAMETERS, SERVO_FILE

SEEN = 3.0  # s in which a node that runs is seen


class FollowedTwin:
    """Knows the followed twin by its ``name``: of a node in the namespace of ``node``, or full."""

    def __init__(self, node: Node, name: str) -> None:
        self._node, self.name = node, name
        if not name.startswith('/'):
            self.name = f'{node.get_namespace().rstrip("/")}/{name}'
        self._other, self._since = '', 0.0

    def says(self, source: str, kind: str) -> bool:
        """Tell whether an event is of what the followed twin runs; of another twin note it."""
        if source != self.name and kind in (BEGAN, SERVO_FILE):  # which a twin alone tells
            self._other, self._since = source, self._since or monotonic()
        return source == self.name and kind in (BEGAN, PARAMETERS, SERVO_FILE)

    def missed(self) -> str:
        """Say, and log once, that another twin runs and the followed one does not; else ''."""
        if not self._other or monotonic() < self._since + SEEN or self.name in {
                f'{where.rstrip("/")}/{name}'
                for name, where in self._node.get_node_names_and_namespaces()}:
            return ''
        said = (f'the twin {self._other} runs, and this node follows {self.name}, which is not '
                f'there: what {self._other} runs is not known here; start this node with '
                f'-p twin:={self._other}')
        self._node.get_logger().warning(said, once=True)
        return said
