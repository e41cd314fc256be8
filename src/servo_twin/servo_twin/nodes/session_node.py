"""The node with which `servo-twin run` brings rig, twin and recorder up and watches them."""

from __future__ import annotations

from threading import Event, Thread

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from .heard_health import HeardHealth

CONFIGURE = Transition.TRANSITION_CONFIGURE
ACTIVATE = Transition.TRANSITION_ACTIVATE
DEACTIVATE = Transition.TRANSITION_DEACTIVATE

ASKED = 2  # times that a node is asked for a transition


class Session(Node):
    """
    A context: spins in a thread of its own.

    ``facts`` maps `driver`, `twin` and `recorder` of the namespace to what they last said on
    /diagnostics, ``sentences`` to the worst of their messages, ``levels`` to its severity
    (0 is well).
    """

    def __init__(self, namespace: str) -> None:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        super().__init__('session', namespace=namespace)
        health = HeardHealth(namespace)
        self.facts, self.sentences, self.levels = health.facts, health.sentences, health.levels
        self._clients_of: dict[str, object] = {}
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
        """Ask a node of the namespace for a lifecycle transition; return whether it was made."""
        client = self._clients_of.get(node)
        if client is None:
            client = self.create_client(ChangeState, f'{node}/change_state')
            self._clients_of[node] = client
        if not client.wait_for_service(patience):
            return False
        for _ in range(ASKED):  # a request that comes before its way back is known has no answer
            answered = Event()
            future = client.call_async(ChangeState.Request(transition=Transition(id=transition)))
            future.add_done_callback(lambda _, answered=answered: answered.set())
            if answered.wait(patience / ASKED):
                return future.result().success
        return False

    def linked(self, topic: str, readers: int) -> bool:
        """Whether a topic of the namespace has a writer and at least so many readers."""
        return self.count_publishers(topic) > 0 and self.count_subscribers(topic) >= readers
