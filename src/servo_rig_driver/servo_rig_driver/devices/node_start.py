"""
Brings the nodes of a rig from whatever they do to the start of sampling.

They are stopped, told the period of SYNC and how often to beat, and started. Once a node has said
that it is stopped, no answer to an earlier SYNC of it is under way.
"""

from __future__ import annotations

from collections.abc import Callable

from ..can_bus.bus_port import BusPort
from ..driver.rig_health import Heartbeats
from .canopen_listener import CanopenListener
from .canopen_rig import RigFrames
from .device import Outcome
from .doubled_ids import doubled, ECHO, PROMPT
from .doubled_ids import QUIET as SILENCE
from .pdo_table import NMT_ID
from .sdo import REQUEST_ID

SECOND = 1_000_000_000
QUIET = SECOND // 30
HEARTBEAT_MAY_TAKE = 0.3
NMT_START, NMT_PRE_OPERATIONAL = 0x01, 0x80
CYCLE_PERIOD, HEARTBEAT_TIME = 0x1006, 0x1017  # in us and in ms, CiA 301


class NodeStart:
    """
    Starts the nodes, trying again every ``retry`` seconds for as long as it is wanted.

    ``period`` of SYNC in ns; ``now`` returns the time in ns, ``answered`` that of the last answer
    to SYNC. ``doubled`` names the nodes that have
    another one of their id beside them: each request is then answered twice.
    """

    def __init__(self, port: BusPort, frames: RigFrames, listener: CanopenListener, period: int,
                 retry: float, now: Callable[[], int], answered: Callable[[], int]) -> None:
        self.port = port
        self.frames = frames
        self.listener = listener
        self.watch = listener.watch
        self.period = period
        self.retry = retry
        self.now = now
        self.answered = answered
        self.doubled: list[int] = []
        self._heartbeat = round(listener.watch.beats.timeout * 1e3 / 4)

    def run(self, wanted: Callable[[], bool]) -> Outcome:
        """Start all nodes, telling meanwhile which are silent; returns how that ended."""
        self.watch.beats.expect(self.now())
        self.listener.twice.clear()
        steps = (lambda: self._written(CYCLE_PERIOD, self.period // 1000),
                 lambda: self._written(HEARTBEAT_TIME, self._heartbeat),
                 lambda: self._told(NMT_PRE_OPERATIONAL, Heartbeats.PRE_OPERATIONAL),
                 lambda: self._told(NMT_START, Heartbeats.OPERATIONAL))
        for step in steps:
            while not step():
                self.watch.silent(self.now())
                if not wanted():
                    return Outcome.CALLED_OFF
                if self.watch.foreign:
                    return Outcome.FOREIGN
            if self.listener.twice:
                self.doubled = sorted(doubled(self.listener.twice, self._counted, wanted))
                self.listener.twice.clear()
                if self.doubled:
                    return Outcome.DOUBLED
        return Outcome.STARTED

    def _written(self, index: int, value: int, echo: int = ECHO) -> bool:
        requests = self.frames.writing(index, value)
        asked = {(identifier - REQUEST_ID, index) for identifier, _ in requests}
        self.listener.stored.clear()
        self._command(NMT_PRE_OPERATIONAL)
        self.port.send(requests)
        if not self._comes_true(lambda: asked <= self.listener.stored, self.retry):
            return False
        self._comes_true(lambda: False, echo * 1e-9)
        return True

    def _counted(self) -> tuple[set[int], int]:
        """Write once, when no answer is under way; return who answered twice, and in what time."""
        listener = self.listener
        quiet = self.now()
        while self.now() - quiet < SILENCE:
            listener.stored.clear()
            self.port.receive(0.01)
            if listener.stored:
                quiet = self.now()
        listener.twice.clear()
        asked = self.now()
        self._written(HEARTBEAT_TIME, self._heartbeat, PROMPT)
        return set(listener.twice), self.now() - asked - PROMPT

    def _told(self, command: int, state: int) -> bool:
        beats = self.watch.beats
        beats.state.clear()
        self._command(command)

        def done() -> bool:
            still = command == NMT_START or self.now() - self.answered() > QUIET
            return still and beats.all_in(state)

        return self._comes_true(done, max(self.retry, HEARTBEAT_MAY_TAKE))

    def _command(self, command: int) -> None:
        self.port.send([(NMT_ID, bytes([command, node])) for node in self.watch.beats.nodes])

    def _comes_true(self, condition: Callable[[], bool], patience: float) -> bool:
        deadline = self.now() + int(patience * SECOND)
        while not condition():
            if self.now() > deadline or self.watch.foreign:
                return False
            self.port.receive(0.01)
        return True
