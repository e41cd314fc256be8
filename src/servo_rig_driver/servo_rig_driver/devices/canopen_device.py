"""Three CANopen nodes that answer SYNC: a CiA 402 drive, a load encoder, a torque sensor."""

from __future__ import annotations

from collections.abc import Callable

from ..can_bus.bus_port import BusPort, Frames
from ..driver.limits import Mode, Setpoint
from ..driver.rig_health import Heartbeats
from ..driver.rig_watch import RigWatch
from .canopen_listener import CanopenListener
from .canopen_rig import RigFrames
from .cia402 import controlword, drive_state
from .device import Answer, Device, Outcome
from .drive_master import DriveState, Order
from .node_start import NodeStart
from .pdo_table import FrameTable, HEARTBEAT_ID

HEARTBEAT_EVERY = 100_000_000
_AT_ONCE = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT,
            DriveState.FAULT_REACTION_ACTIVE)


class CanopenDevice(Device):
    """
    A rig of CANopen nodes by the table of their PDOs.

    ``period`` of SYNC in ns, ``retry`` in s; ``driver`` is the node id under which the driver
    beats its own heart.
    """

    tells_restart = True

    def __init__(self, table: FrameTable, watch: RigWatch, period: int, retry: float,
                 driver: int) -> None:
        self.frames = RigFrames(table)
        self.nodes = self.frames.nodes
        self.kinds = self.frames.kinds
        self.doubled: list[int] = []
        self._listener = CanopenListener(watch, self.frames.masters, self.frames.stops)
        self._period, self._retry = period, retry
        self._heart = HEARTBEAT_ID + driver, bytes([Heartbeats.OPERATIONAL])
        self._beaten = 0
        self._answered_at = 0
        self._state = DriveState.UNKNOWN
        self._doubted: DriveState | None = None

    @property
    def state(self) -> DriveState:
        """How the drive stands by its last statusword."""
        return self._state

    @property
    def fault(self) -> str:
        """The last emergency of the drive in words."""
        return self._listener.emergency

    @property
    def missed(self) -> bool:
        """Whether the last emergency is that SYNC, set-points or heartbeats did not come."""
        return self._listener.missed

    def modes(self) -> list[Mode]:
        """Return the modes that the drive has a target for."""
        return self.frames.modes()

    def carried(self) -> dict[Mode, tuple[float, float]]:
        """Return what the objects of the drive's targets hold."""
        return self.frames.carried()

    def start(self, port: BusPort, now: Callable[[], int], wanted: Callable[[], bool]) -> Outcome:
        """Stop the nodes, tell them the period and how often to beat, and start them."""
        starting = NodeStart(port, self.frames, self._listener, self._period, self._retry, now,
                             lambda: self._answered_at)
        outcome = starting.run(wanted)
        self.doubled = starting.doubled
        return outcome

    def ask(self, number: int, order: Order, point: Setpoint | None, now: int) -> Frames:
        """Return set-point, controlword and SYNC, and the driver's heartbeat when it is due."""
        frames = self.frames.command(number, controlword(order, self._state), point)
        if now - self._beaten > HEARTBEAT_EVERY:
            self._beaten = now
            frames.append(self._heart)
        return frames

    def unsent(self) -> None:
        """Say everything again."""
        self.frames.forget()
        self._beaten = 0

    def rest(self, number: int, now: int) -> Frames:
        """Return zero and "disable voltage", without a SYNC."""
        return self.frames.command(number, controlword(Order.NO_TORQUE, self._state), None)[:-1]

    def take(self, identifier: int, data: bytes, now: int) -> Answer | None:
        """Take a PDO, or leave what is none to the listener."""
        known = self.frames.answers.get(identifier)
        if known is None:
            self._listener.take(identifier, data, now)
            return None
        self._answered_at = now
        answer, frame = known
        values = answer.take(frame, data)
        if values is None:
            return None
        word = self.frames.statusword(answer, values)
        if word is not None:
            self._tell(drive_state(word))
        place = answer.counter_at
        return Answer(answer.kind, values, None if place is None else int(values[place]))

    def _tell(self, told: DriveState) -> None:
        """Take a state; that an enabled drive went down without a fault it has to tell twice."""
        stopped = self._state is DriveState.OPERATION_ENABLED and told not in _AT_ONCE
        if stopped and told is not self._doubted:
            self._doubted = told
            return
        self._state, self._doubted = told, None

    def row(self, answers: list[list[float]], point: Setpoint | None) -> list[float]:
        """Return one sample by COLUMNS."""
        return self.frames.row(answers, point)

    def forget(self) -> None:
        """Say everything again at the next tick, and wait for the drive's next word."""
        self.frames.forget()
        self._state, self._doubted = DriveState.UNKNOWN, None
