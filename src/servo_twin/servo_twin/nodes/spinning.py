"""How a node of these packages spins, and how it ends when it is told to."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .ending import Ending
from .ros_start import start_ros


def started(arguments: list[str] | None = None) -> Ending:
    """Start ROS without its own signal handlers and return who takes the signals instead."""
    ending = Ending()
    start_ros(arguments)
    return ending


def named(name: str, namespace: str) -> list[str]:
    """
    Return arguments for a second node of this process: its own name, all remaps of the first one.

    A name given to the process would go to both otherwise, and two nodes would have one name.
    """
    return ['--ros-args', '-r', f'__node:={name}', '-r', f'__ns:={namespace}']


@contextmanager
def interruptible(ending: Ending) -> Iterator[None]:
    """Let the first signal break off what is done inside, such as compiling, without an error."""
    def stop() -> None:
        raise KeyboardInterrupt

    before, ending.then = ending.then, stop
    try:
        yield
    except KeyboardInterrupt:
        before()
    finally:
        ending.then = before
