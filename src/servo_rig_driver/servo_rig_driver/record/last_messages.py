"""What has come to a node by the time that it is told to end."""

from __future__ import annotations

from typing import Any

from rclpy.task import Future

CATCH_UP = 2.0  # s; who ends a recorder waits no longer for what it has not written


def take_what_has_come(executor: Any, over: Future) -> None:
    """Have an executor do what waits now, unless the node is over; what comes later is left."""
    if not over.done():
        last = executor.create_task(lambda: None)  # behind all that waits
        executor.spin_until_future_complete(last, CATCH_UP)
