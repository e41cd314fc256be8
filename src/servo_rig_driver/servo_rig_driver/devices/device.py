"""
What the driver needs of the devices on a bus, whatever protocol they speak.

The link brings a device up (`start`), asks it for a sample at each tick with the order and the
set-point that go with it (`ask`), hands it all that comes in (`take`) and takes its torque away
(`rest`). A protocol is a table of frames and one class that says these four things by them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from enum import Enum
from typing import ClassVar, NamedTuple

from ..can_bus.bus_port import BusPort, Frames
from ..driver.limits import Mode, Setpoint
from .drive_master import DriveState, Order


class Outcome(Enum):
    """How starting a device ended."""

    STARTED = 'started'
    CALLED_OFF = 'called off'
    FOREIGN = 'another driver speaks'
    DOUBLED = 'two nodes have one id'


class Answer(NamedTuple):
    """
    What one node said to one request.

    ``kind`` is the node's place in a sample, ``counter`` what it echoed of the request, None where
    it echoes nothing.
    """

    kind: int
    values: list[float]
    counter: int | None


class DeviceError(ValueError):
    """A table or a setting of a device that cannot be used; the text names it and the choice."""


class Device(ABC):
    """
    The devices of one rig on one bus, seen from the driver.

    ``nodes`` names whom the driver must hear, by number; ``kinds`` is how many answers make a
    sample; ``doubled`` are the nodes that another one of their number stands beside, after a start
    that ended so. ``emergency_stop`` says that somebody has stopped the drive, so that nobody but
    a person may enable it again.
    """

    fd: ClassVar[bool] = False
    """Whether the bus has to be CAN FD."""
    on_request: ClassVar[bool] = False
    """Whether each request is answered once and in order, by answers that name no request."""
    tells_restart: ClassVar[bool] = False
    """Whether the drive tells that it has started again, however short it was away."""

    nodes: Mapping[int, str]
    kinds: int
    doubled: list[int]
    emergency_stop = False
    missed = False
    """Whether the drive's fault is that it missed frames of the driver."""
    silence = 0
    """For how many ns a drive that is asked may be left without a request."""

    @property
    @abstractmethod
    def state(self) -> DriveState:
        """How the drive stands, as far as it has told."""

    @property
    @abstractmethod
    def fault(self) -> str:
        """What the drive says is wrong, in words; empty where it says nothing."""

    @abstractmethod
    def modes(self) -> list[Mode]:
        """Return the modes of command that the drive takes."""

    def carried(self) -> dict[Mode, tuple[float, float]]:
        """Return the smallest and largest reference that the frames carry, by mode; {}: any."""
        return {}

    @property
    def no_position(self) -> str:
        """Why the drive is given no position as it stands, and what to do; '' where it may be."""
        return ''

    @abstractmethod
    def start(self, port: BusPort, now: Callable[[], int], wanted: Callable[[], bool]) -> Outcome:
        """Bring all nodes to where they answer, without torque; tries for as long as wanted."""

    def query(self) -> Frames:
        """Return a request that changes nothing and gives no torque; []: there is none."""
        return []

    @abstractmethod
    def ask(self, number: int, order: Order, point: Setpoint | None, now: int) -> Frames:
        """
        Return the frames of tick ``number``, sent at ``now`` ns: order, set-point and request.

        Without a set-point, or with one of mode OFF, the motor gets zero.
        """

    @abstractmethod
    def unsent(self) -> None:
        """Note that the frames of an ask() did not reach the drive; another ask() follows."""

    @abstractmethod
    def rest(self, number: int, now: int) -> Frames:
        """Return the frames that take the torque away at once, without a request."""

    @abstractmethod
    def take(self, identifier: int, data: bytes, now: int) -> Answer | None:
        """
        Take a frame that came in; return the answer that it completes, if any.

        Raises FrameError for an answer of the wrong length.
        """

    @abstractmethod
    def row(self, answers: list[list[float]], point: Setpoint | None) -> list[float]:
        """Return one sample by COLUMNS of sample_blocks.py: what was measured and asked for."""

    @property
    def settled(self) -> bool:
        """Whether `state` was told after the last frame that asked for another one."""
        return True

    def proves_down(self, port: BusPort, now: Callable[[], int], wanted: Callable[[], bool]
                    ) -> bool:
        """Have it tell `state` again where what it told may be older than the order to go down."""
        return True

    def starved(self, now: int) -> bool:
        """Whether its watchdog may just have taken the torque away, which it does not tell."""
        return False

    def loss(self, now: int) -> str:
        """Return by what it may have lost its supply if it is down, in words; '' for nothing."""
        return ''

    def answered(self, number: int) -> None:
        """Note that the request of tick ``number`` was answered in full."""
        return

    def doubted(self, now: int) -> bool:
        """Whether the drive has to tell how it stands before it is given another set-point."""
        return False

    @abstractmethod
    def forget(self) -> None:
        """Forget what the drive was told and has told, as after a restart."""
