"""
One drive that is asked for each sample and answers once: what ODrive, MIT mode and moteus share.

An answer names no request; driver/order_joining.py finds it. None of these drives has a quick stop
of its own: the driver brakes it to rest by its speed loop, and then takes the torque away.
"""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Mapping
from typing import ClassVar

from ..can_bus.bus_port import BusPort, Frames
from ..driver.limits import Mode, Setpoint
from ..driver.rig_watch import RigWatch
from ..driver.sample_blocks import COLUMNS
from .device import Answer, Device, Outcome
from .doubled_ids import doubled, ECHO, PROMPT, QUIET, RESTLESS
from .drive_master import DriveState, Order
from .drive_reading import MOTOR, Reading
from .drive_settings import DriveSettings

NO_ANSWER = -1
"""The kind of a frame that a drive sends by itself, or that is not part of a sample."""
LAPSE_LASTS = 250_000_000
"""For how long after requests or answers were late a drive may go down for it, ns."""

SILENT = 'did not answer for a while, so that it may have lost its supply,'
"""What may have happened to a drive that goes down after a silence."""


class OnRequest(Device):
    """A drive asked by one frame or a few; a protocol says which, and reads what comes back."""

    on_request = True
    kinds = 1
    silent_watchdog: ClassVar[bool] = False
    """Whether its watchdog takes the torque away without a fault."""
    tells_state = True  # whether its answers tell how it stands

    def __init__(self, settings: DriveSettings, watch: RigWatch) -> None:
        self.settings = settings
        self.silence = round(settings.watchdog * 0.5e9)
        self.watch = watch
        self.nodes: Mapping[int, str] = watch.nodes
        self.doubled: list[int] = []
        self.reading = Reading()
        self._sampling = False  # whether answers are samples
        self._answers = self._answered = 0
        self.forget()

    @property
    def state(self) -> DriveState:
        """How the drive stands by what it told last."""
        return self._state

    @property
    def fault(self) -> str:
        """What the drive told last is wrong, in words; empty for nothing."""
        return self._fault

    @abstractmethod
    def frames(self, order: Order, point: Setpoint | None, now: int) -> Frames:
        """Return an order with its set-point, and the request for an answer; ``now`` in ns."""

    @abstractmethod
    def query(self) -> Frames:
        """Return a request for an answer that changes nothing in a drive, and gives no torque."""

    @abstractmethod
    def off(self) -> Frames:
        """Return the frames that take the torque away."""

    @abstractmethod
    def hear(self, identifier: int, data: bytes) -> int | None:
        """
        Keep what a frame of the drive tells; return which answer to a request it is, from 0.

        NO_ANSWER for a frame that answers none, None for one that is not the drive's. The first
        answer tells the angle, the last one the current. Raises FrameError for a wrong length.
        """

    @abstractmethod
    def foreign(self, identifier: int, data: bytes) -> str:
        """Return in words what another driver told this drive by a frame, empty for all others."""

    @abstractmethod
    def stops(self, identifier: int, data: bytes) -> bool | None:
        """Whether a frame of another driver takes the torque away, lets it come, or neither."""

    def start(self, port: BusPort, now: Callable[[], int], wanted: Callable[[], bool]) -> Outcome:
        """Ask until the drive answers, once to each request."""
        self.watch.beats.expect(now())
        asked = 0
        while True:
            asked += 1
            answers = self._asked(port, now)
            if not wanted():
                return Outcome.CALLED_OFF
            if self.watch.foreign:
                return Outcome.FOREIGN
            if answers:
                break
            self.watch.silent(now())
        if answers > 1 or self.watch.doubtful:
            self.watch.doubtful = False
            pair = doubled(self.nodes.keys(), lambda: self._counted(port, now, wanted), wanted)
            if pair:
                self.doubled = sorted(pair)
                return Outcome.DOUBLED
        if asked > 1:  # a late answer would be taken for that to the first sample
            self._quiet(port, now, wanted)
        return Outcome.STARTED

    def _counted(self, port: BusPort, now: Callable[[], int], wanted: Callable[[], bool]
                 ) -> tuple[set[int], int]:
        """Ask once, after a silence; return who answered twice, and within what time, ns."""
        self._quiet(port, now, wanted, QUIET)
        asked = now()
        twice = self._asked(port, now, PROMPT) > 1
        return set(self.nodes) if twice else set(), self._answered - asked

    def _quiet(self, port: BusPort, now: Callable[[], int], wanted: Callable[[], bool],
               long: int = 5 * ECHO) -> bool:
        """Wait, up to RESTLESS, until no answer has come for so long, ns; whether that was so."""
        begun = quiet_since = now()
        while wanted() and now() - quiet_since < long and now() - begun < RESTLESS:
            self._answers = 0
            port.receive(0.01)
            if self._answers:
                quiet_since = now()
        return now() - quiet_since >= long

    def proves_down(self, port: BusPort, now: Callable[[], int], wanted: Callable[[], bool]
                    ) -> bool:
        """
        Ask once more, when no earlier answer is under way; whether an answer came.

        An answer names no request: one that comes twice would be taken for that to a stop frame
        which has not arrived, or never will.
        """
        if not self._quiet(port, now, wanted):
            return False
        frames = self.frames(Order.NO_TORQUE, None, now())
        self._state = DriveState.UNKNOWN
        answers = self._asked(port, now, frames=frames)
        if answers:
            self.obeyed(self._sent)
        return answers > 0

    def _asked(self, port: BusPort, now: Callable[[], int], echo: int = ECHO,
               frames: Frames | None = None) -> int:
        """Return how many answers one request gets, up to ``echo`` ns after the first one."""
        self._answers, self._sampling = 0, False
        port.send(frames or self.query())
        until = now() + max(ECHO, round(self.settings.retry * 1e9))
        self._answered = until
        while now() < until and not self.watch.foreign:
            port.receive(0.005)
            if self._answers and self._answered > now():
                self._answered = now()
                until = self._answered + echo
        return self._answers

    def ask(self, number: int, order: Order, point: Setpoint | None, now: int) -> Frames:
        """Return the order, the set-point and the request."""
        self._sampling = True
        if self._unasked(now):
            self._late_at = now
        self._asked_at = now
        order = self._settled(order)
        doubted = order is Order.ENABLE and self.doubted(now)
        if doubted:
            self.unsent()  # it may have forgotten what it was told
            if not self.tells_state:
                self._state = DriveState.UNKNOWN  # so that it is told to stop, and then led up
        frames = self.query() if doubted else self.frames(order, point, now)
        self._last_order = order
        self._open.append((number, self._sent))
        return frames

    def answered(self, number: int) -> None:
        """Take what request ``number`` said as obeyed."""
        said = ''
        while self._open and self._open[0][0] <= number:
            _, said = self._open.popleft()
        if said:
            self.obeyed(said)

    def obeyed(self, said: str) -> None:
        """Note that the drive has answered a frame, by the name that a protocol gave it."""
        return

    def doubted(self, now: int) -> bool:
        """Whether it has been silent so long that it may have stopped, or started again."""
        return bool(self._heard_at) and now - self._heard_at > self.silence

    def _late(self, now: int) -> bool:
        """Whether this driver has left it without a request until now, or did so lately."""
        return _lately(self._late_at, now) or self._unasked(now)

    def _unasked(self, now: int) -> bool:
        return bool(self._asked_at) and now - self._asked_at > self.silence

    def starved(self, now: int) -> bool:
        """Whether it says nothing of its watchdog, which late requests may have let run out."""
        return self.silent_watchdog and self._late(now)

    def loss(self, now: int) -> str:
        """Return that it leaves requests unanswered, or what was noted lately."""
        if _lately(self._lost_at, now):
            return self._loss
        return SILENT if self.doubted(now) and not self._late(now) else ''

    def _note_loss(self, words: str) -> None:
        self._loss, self._lost_at = words, self._asked_at

    def _settled(self, order: Order) -> Order:
        """Return the order, or that to take the torque away once a quick stop has come to rest."""
        if order is not Order.QUICK_STOP:
            if order is Order.ENABLE:
                self._braked, self._rested = 0, False
            return order
        slow = abs(self.reading.load_speed) <= self.settings.rest_speed
        self._rested |= self._braked > 1 and slow
        self._braked += 1
        return Order.NO_TORQUE if self._rested else order

    def rest(self, number: int, now: int) -> Frames:
        """Return the frames that take the torque away; what they are answered is no sample."""
        self._sampling = False
        return self.off()

    def take(self, identifier: int, data: bytes, now: int) -> Answer | None:
        """Take a frame of the drive, or note that another driver speaks."""
        kind = self.hear(identifier, data)
        if kind is None:
            if words := self.foreign(identifier, data):
                self.watch.hear_foreign(words, now, self.stops(identifier, data))
            return None
        if self.doubted(now) and not self._late(now):
            self._note_loss(SILENT)
        self._heard_at = now
        self.watch.beats.beat(self.settings.node, 0, now)
        self._answers += kind == self.kinds - 1
        tells = self._sampling and kind != NO_ANSWER
        return Answer(kind, self.reading.row(), None) if tells else None

    def row(self, answers: list[list[float]], point: Setpoint | None) -> list[float]:
        """Return one sample by COLUMNS: what was measured, and the reference it began with."""
        row = answers[-1]
        row[MOTOR] = answers[0][MOTOR]
        if point is not None and point.mode in _REFERENCES:
            row[_REFERENCES[point.mode]] = point.reference
        return row

    def modes(self) -> list[Mode]:
        """Return the modes of command: all but the voltage at the winding."""
        return [Mode.OFF, Mode.CURRENT, Mode.VELOCITY, Mode.POSITION]

    def forget(self) -> None:
        """Forget what the drive was told and has told."""
        self.reading = Reading()
        self._state, self._fault = DriveState.UNKNOWN, ''
        self._last_order: Order | None = None
        self._braked, self._rested = 0, False
        self._open: deque[tuple[int, str]] = deque()  # requests, and what they said
        self._sent = ''
        self._asked_at = self._heard_at = self._late_at = self._lost_at = 0  # 0: not yet
        self._loss = ''
        self.forget_told()

    @abstractmethod
    def forget_told(self) -> None:
        """Forget, or set for the first time, what a protocol keeps beside these."""

    def up(self, order: Order) -> bool:
        """Whether an order is to be given to a drive that follows its reference."""
        return self._state is DriveState.OPERATION_ENABLED and order in (
            Order.ENABLE, Order.QUICK_STOP)

    def clears(self, order: Order) -> bool:
        """Whether an order is to clear a fault; once, until another order comes."""
        return order is Order.RESET and self._last_order is not Order.RESET


def _lately(instant: int, now: int) -> bool:
    return bool(instant) and now - instant < LAPSE_LASTS


_REFERENCES = {Mode.VELOCITY: COLUMNS.index('reference_velocity'),
               Mode.POSITION: COLUMNS.index('reference_position')}
