"""A run has its namespace to itself: two in one would drive one motor."""

from __future__ import annotations

from collections.abc import Collection
from time import monotonic, sleep

from ..nodes.session_node import Session
from .processes import ProcessError, Processes

NODES = ('driver', 'player', 'recorder', 'twin')
"""The nodes that a run starts, each once."""
AT_FIRST = 0.5  # s from joining the graph until those who are there are known as a rule
AT_LAST = 3.3  # s: DDS announces a process every 3 s, where nobody heard what it said at first


def refuse_taken(session: Session, own: Collection[str] = ()) -> None:
    """
    Raise ProcessError where a node of another run is there, or another publisher of commands.

    ``own`` are the nodes that this run has started by now.
    """
    if _others(session, own):
        sleep(AT_FIRST)  # who else is there comes with them
        said = _others(session, own)
        if said:
            raise ProcessError(
                f'{session.get_namespace()} is taken: {"; ".join(said)}. Two runs would drive one '
                'motor. Choose another --namespace, or another ROS_DOMAIN_ID; a process that was '
                'killed counts for up to 20 s')


def _others(session: Session, own: Collection[str]) -> list[str]:
    """Return who is there beside the nodes of this run, and who else commands, in words."""
    there, commanding = session.nodes(), session.publishers('command')
    said = [f'{name} runs' for name in NODES if there.count(name) > (name in own)]
    if len(commanding) > ('player' in own):
        said.append(f'command is published by {", ".join(sorted(set(commanding)))}')
    return said


def look_around(session: Session, seconds: float, processes: Processes,
                own: Collection[str] = ()) -> None:
    """Look for others until the session is so many ``seconds`` in the graph; raises as above."""
    while monotonic() < session.began + seconds:
        processes.check()
        refuse_taken(session, own)
        sleep(0.02)
    refuse_taken(session, own)
