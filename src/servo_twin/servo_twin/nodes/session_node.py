"""The node with which `servo-twin run` brings rig, twin and recorder up and watches them."""

from __future__ import annotations

from threading import Event, Thread
from time import monotonic
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
import rclpy
from rclpy.client import Client
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from .ended_processes import ended
from .heard_health import HeardHealth
from .ros_start import start_ros

CONFIGURE = Transition.TRANSITION_CONFIGURE
ACTIVATE = Transition.TRANSITION_ACTIVATE
DEACTIVATE = Transition.TRANSITION_DEACTIVATE

EVERYBODYS = '/parameter_events'
"""A topic that every node publishes."""
AGAIN = 1.0  # s after which a node without an answer is asked for its state again


class Session(Node):
    """
    A context: spins in a thread of its own.

    ``facts`` maps `driver`, `twin`, `recorder` and `player` of the namespace to what they last
    said on /diagnostics, ``sentences`` to the worst of their messages, ``levels`` to its severity
    (0 is well), ``counts`` to how often it was heard. It joined the graph at ``began``, s of the
    monotonic clock.
    """

    def __init__(self, namespace: str) -> None:
        start_ros()
        super().__init__('session', namespace=namespace)
        self.began = monotonic()
        health = HeardHealth(namespace)
        self.facts, self.sentences, self.levels = health.facts, health.sentences, health.levels
        self.counts = health.counts
        self._clients_of: dict[str, tuple[Client, Client]] = {}
        self.create_subscription(DiagnosticArray, '/diagnostics', health.hear, 100)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        self._thread = Thread(target=self._spin, daemon=True)

    def __enter__(self) -> Session:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        rclpy.try_shutdown()
        self._thread.join(2.0)
        if not self._thread.is_alive():
            self.destroy_node()

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except (KeyboardInterrupt, ExternalShutdownException):
            return

    def change(self, node: str, transition: int, patience: float = 30.0) -> bool:
        """
        Ask a node of the namespace for a lifecycle transition; return whether it was made.

        An answer is lost where the node has not heard of the client yet. Clients are announced in
        order, so a node that has answered the later one knows the way back to both.
        """
        until = monotonic() + patience
        if node not in self._clients_of:
            self._clients_of[node] = (self.create_client(ChangeState, f'{node}/change_state'),
                                      self.create_client(GetState, f'{node}/get_state'))
        changes, states = self._clients_of[node]
        while self._answer(states, GetState.Request(), AGAIN) is None:
            if monotonic() > until:
                return False
        answer = self._answer(changes, ChangeState.Request(transition=Transition(id=transition)),
                              until - monotonic())
        return answer is not None and answer.success

    @staticmethod
    def _answer(client: Client, request: Any, patience: float) -> Any:
        """Return what a service answers within some seconds, None where it does not."""
        if not client.wait_for_service(patience):
            return None
        answered, future = Event(), client.call_async(request)
        future.add_done_callback(lambda _: answered.set())
        return future.result() if answered.wait(patience) else None

    def nodes(self) -> list[str]:
        """Return the names of all nodes of the namespace that are known by now."""
        return [name for name, where in self.get_node_names_and_namespaces()
                if where == self.get_namespace()]

    def publishers(self, topic: str) -> list[str]:
        """Return who publishes a topic of the namespace, by full names."""
        return [f'{one.node_namespace.rstrip("/")}/{one.node_name}'
                for one in self.get_publishers_info_by_topic(self.resolve_topic_name(topic))]

    def killed(self, topic: str) -> list[str]:
        """Return the names of those nodes here that publish a topic and were killed."""
        infos = self.get_publishers_info_by_topic(self.resolve_topic_name(topic))
        own = next((one.endpoint_gid for one in self.get_publishers_info_by_topic(EVERYBODYS)
                    if one.node_name == self.get_name()), [])
        return [one.node_name for one in infos if one.node_namespace == self.get_namespace()
                and ended(one.endpoint_gid, own)]

    def linked(self, topic: str, readers: int) -> bool:
        """Whether a topic of the namespace has a writer and at least so many readers."""
        return self.count_publishers(topic) > 0 and self.count_subscribers(topic) >= readers

    def heard(self, node: str, topic: str, readers: int) -> bool:
        """
        Whether a node itself knows of at least so many readers of its topic.

        It may know of them later than this node does, and what it says until then is lost to them.
        """
        return int(self.facts.get(node, {}).get(f'readers of {topic}', 0)) >= readers
