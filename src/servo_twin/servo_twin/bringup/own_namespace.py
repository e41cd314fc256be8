"""A run has its namespace to itself: two in one would drive one motor."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection
from time import monotonic, sleep

from ..nodes.session_node import EVERYBODYS, Session
from .processes import ProcessError, Processes, wait_until

NODES = ('driver', 'player', 'recorder', 'twin')
"""The nodes that a run starts, each once."""
AT_FIRST = 0.5  # s from joining the graph until those who are there are known as a rule
AT_LAST = 3.3  # s: DDS announces a process every 3 s, where nobody heard what it said at first
FORGOTTEN = 40.0  # s: DDS forgets a process that was killed after 20 s; of a busy machine


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
                'motor. Choose another --namespace, or another ROS_DOMAIN_ID')


def outlast(session: Session, processes: Processes, say: Callable[[str], None]) -> None:
    """
    Wait until DDS has forgotten what is left in the namespace of processes that were killed.

    Until then their topics count as read and written. Raises ProcessError where that takes too
    long.
    """
    left = _left(session)
    if left:
        say(f'waiting up to 20 s until DDS has forgotten {", ".join(left)}, which was killed')
        wait_until(lambda: not _left(session), f'{", ".join(left)} of a killed run is forgotten',
                   FORGOTTEN, processes)


def _left(session: Session) -> list[str]:
    return sorted({name for name in session.killed(EVERYBODYS) if name in NODES}
                  | set(session.killed('command')))


def _others(session: Session, own: Collection[str]) -> list[str]:
    """Return who is there beside the nodes of this run, and who else commands, in words."""
    there = Counter(session.nodes()) - Counter(session.killed(EVERYBODYS))
    commanding = session.publishers('command')
    said = [f'{name} runs' for name in NODES if there[name] > (name in own)]
    if len(commanding) - len(session.killed('command')) > ('player' in own):
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
