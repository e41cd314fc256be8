"""
Opens the CAN bus that a configuration names; nothing else knows which kind it is.

    bus: {interface: unix_bus, channel: rig.can}               # processes of one machine
    bus: {interface: virtual, channel: rig}                    # threads of one process
    bus: {interface: socketcan, channel: can0, bitrate: 1000000}
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import can

from .controller_errors import advised, controller_state
from .unix_bus import from_message, to_message, UnixBus

INTERFACES = ('unix_bus', 'virtual', 'socketcan')


class BusError(ValueError):
    """A configuration of the bus that cannot be used."""


@dataclass(frozen=True)
class BusSettings:
    """
    Which bus: python-can's interface, its channel, and the bitrate in bit/s for socketcan.

    ``fd`` opens it for CAN FD; the rate of the data is that of the device (`ip link`).
    """

    interface: str = 'unix_bus'
    channel: str = 'servo_rig.can'
    bitrate: int = 1_000_000
    fd: bool = False

    def __post_init__(self) -> None:
        """Raise BusError for an unknown interface, an empty channel or an impossible bitrate."""
        if self.interface not in INTERFACES:
            raise BusError(f"bus.interface = '{self.interface}' is unknown; it is one of "
                           f'{list(INTERFACES)}')
        if not self.channel:
            raise BusError('bus.channel is empty; give a socket path, a name or a CAN device')
        if not 10_000 <= self.bitrate <= 1_000_000:
            raise BusError(f'bus.bitrate = {self.bitrate} bit/s is outside [10000, 1000000]')


def open_bus(settings: BusSettings, wait: float = 2.0) -> can.BusABC:
    """
    Open the bus, waiting up to ``wait`` seconds for a hub where the interface needs one.

    Raises can.CanError when it cannot be opened.
    """
    try:
        if settings.interface == 'unix_bus':  # needs no entry point, as in a source tree
            return UnixBus(settings.channel, wait=wait)
        return can.Bus(interface=settings.interface, channel=settings.channel,
                       bitrate=settings.bitrate, fd=settings.fd)
    except (OSError, ValueError, can.CanError) as error:  # a path that no socket can have
        raise can.CanInitializationError(
            f'cannot open {settings.interface} {settings.channel}: '
            f'{advised(error, settings.channel, settings.bitrate)}') from error


class Wire:
    """
    Frames as (identifier, data) over any python-can bus, without its messages where it can.

    Raises can.CanError when the bus is gone. Identifiers carry the flags of unix_frames.py, so a
    standard data frame is its bare identifier. Error frames are left out of recv(), and
    ``controller`` keeps what the last of them said: '' for nothing wrong, None while none came.
    """

    def __init__(self, bus: can.BusABC, settings: BusSettings = BusSettings()) -> None:
        self.bus = bus
        self.controller: str | None = None
        self._settings = settings
        self._packed = hasattr(bus, 'send_frames')

    def send(self, frames: Sequence[tuple[int, bytes]], until: int | None = None,
             tag: int = 0) -> None:
        """
        Send frames in their order.

        A hub passes none on after ``until``, ns of CLOCK_MONOTONIC: see late(). The queue of
        a CAN controller knows no such thing.
        """
        if self._packed:
            self.bus.send_frames(frames, until, tag)
            return
        try:
            for identifier, data in frames:
                self.bus.send(to_message(identifier, data))
        except can.CanOperationError as error:
            raise self._advised(error) from error

    def _advised(self, error: can.CanError) -> can.CanError:
        return can.CanOperationError(advised(error, self._settings.channel,
                                             self._settings.bitrate))

    def late(self) -> list[int]:
        """Return the tags of what came back, since it was too late, as far as recv() saw it."""
        returned = self.bus.returned if self._packed else ()
        return [returned.popleft() for _ in range(len(returned))]

    def recv(self, timeout: float | None = None) -> list[tuple[int, bytes]]:
        """Return the frames that came next, or [] when none came within ``timeout`` seconds."""
        if self._packed:
            return self.bus.recv_frames(timeout)
        try:
            message = self.bus.recv(timeout)
        except can.CanOperationError as error:
            raise self._advised(error) from error
        if message is None:
            return []
        if message.is_error_frame:
            said = controller_state(message)
            self.controller = self.controller if said is None else said
            return []
        return [from_message(message)]
