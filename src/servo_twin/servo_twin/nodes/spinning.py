"""How a node of these packages spins, and how it ends when it is told to."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.task import Future

LOOKS = 1.0  # s, after which an executor that was not woken sees that ROS is shut down


def spin(executor: EventsExecutor) -> None:
    """Spin until ROS is shut down; looked at again and again, as a signal may come in between."""
    while rclpy.ok():
        executor.spin_until_future_complete(Future(), LOOKS)


@contextmanager
def until_stopped() -> Iterator[None]:
    """Let a signal end what is done inside without an error."""
    try:
        yield
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:  # rclpy raises an RCLError of its own where a signal came between
        if rclpy.ok():
            raise
