"""
A CAN bus between processes of one machine: a python-can interface over a Unix socket.

Its other end is the hub of can_hub.py. Unlike python-can's udp_multicast it loses nothing and
never gives a node its own frames back, which CiA 402's state machine does not survive.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import groupby
import os
from pathlib import Path
import select
import socket
import struct
import time

import can

from . import unix_frames as can_frames
from .private_folder import socket_path

LARGEST = can_frames.LARGEST + can_frames.EXPIRY.size
LONGEST_PATH = 107  # bytes; limit of Linux's sockaddr_un
SENDING_MAY_TAKE = 2.0  # s; the hub reads at once, so this passes only when it hangs


def check_path(path: str) -> str:
    """
    Return the path of a bus's socket; a name without a slash lies in the user's private folder.

    Raises ValueError when no socket can have it, PermissionError where that folder is not private.
    """
    path = socket_path(str(path)) if path else ''
    size = len(path.encode())
    if not 0 < size <= LONGEST_PATH:
        raise ValueError(f"'{path}' has {size} bytes; the path of a Unix socket has 1 to "
                         f'{LONGEST_PATH}')
    return path


def listening(path: Path) -> socket.socket:
    """Return a new socket that clients may connect to; raises OSError that names its path."""
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        listener.bind(str(path))
        path.chmod(0o600)  # whoever may write to it commands the drive
    except OSError as error:
        listener.close()
        raise OSError(f'{path}: no socket can be made there, {error.strerror}; choose a path in a '
                      'folder that you may write to') from None
    listener.listen(64)
    listener.setblocking(False)
    return listener


def connect(path: str, wait: float) -> socket.socket:
    """
    Return a socket that the hub at ``path`` has greeted, waiting up to ``wait`` seconds for it.

    Raises can.CanInitializationError when there is none by then.
    """
    deadline = time.monotonic() + wait
    while True:
        client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            client.connect(check_path(path))
            client.settimeout(max(0.1, deadline - time.monotonic()))
            _check_owner(path, owner_of(client))
            if client.recv(LARGEST) == can_frames.GREETING:
                return client
            raise ConnectionError('what answers is no CAN hub')
        except OSError as error:
            client.close()
            if time.monotonic() >= deadline:
                raise can.CanInitializationError(
                    f'no CAN hub answers at {path} ({error.strerror or error}); start one with '
                    f'"python -m servo_rig_driver.can_bus.can_hub {path}". A real drive is on '
                    'no hub: set bus.interface to socketcan and bus.channel to its device, such '
                    'as can0') from error
        time.sleep(0.01)


def owner_of(client: socket.socket) -> int:
    """Return the user id of the process at the other end of a connection."""
    credentials = client.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize('3i'))
    return struct.unpack('3i', credentials)[1]


def _check_owner(path: str, owner: int) -> None:
    """Refuse the hub of another user, who may have taken the path first."""
    if owner not in (os.geteuid(), 0):
        raise PermissionError(0, f'it belongs to user {owner}, and you are {os.geteuid()}')


def to_message(identifier: int, data: bytes, timestamp: float = 0.0) -> can.Message:
    """Return a frame as python-can's message."""
    extended = bool(identifier & can_frames.EXTENDED)
    mask = can_frames.EXTENDED_MASK if extended else can_frames.STANDARD_MASK
    fd = bool(identifier & can_frames.FD)
    return can.Message(
        timestamp=timestamp, arbitration_id=identifier & mask, is_extended_id=extended,
        is_remote_frame=bool(identifier & can_frames.REMOTE),
        is_error_frame=bool(identifier & can_frames.ERROR), is_fd=fd, bitrate_switch=fd, data=data)


def from_message(message: can.Message) -> tuple[int, bytes]:
    """Return python-can's message as (identifier with the flags of unix_frames.py, data)."""
    identifier = (message.arbitration_id | can_frames.EXTENDED * message.is_extended_id
                  | can_frames.REMOTE * message.is_remote_frame
                  | can_frames.ERROR * message.is_error_frame | can_frames.FD * message.is_fd)
    return identifier, bytes(message.data)


class UnixBus(can.BusABC):
    """
    One node's place on the bus whose hub listens at ``channel``, the path of a socket.

    Raises can.CanOperationError when the hub goes away; open a new bus then. It carries classic
    frames and CAN FD. ``refused`` counts packets from the hub that were no frames; ``returned``
    holds the tags of those sent that the hub got too late to pass on.
    """

    def __init__(self, channel: str, can_filters: can.typechecking.CanFilters | None = None,
                 wait: float = 2.0, **kwargs: object) -> None:
        self._open = False
        self._socket = connect(channel, wait)
        self._socket.setblocking(False)  # one thread may send while another one waits
        self._open = True
        self._waiting: deque[tuple[int, bytes]] = deque()
        self.refused = 0
        self.returned: deque[int] = deque()
        self.channel_info = f'Unix bus {channel}'
        super().__init__(channel=channel, can_filters=can_filters, **kwargs)

    def send_frames(self, frames: Sequence[tuple[int, bytes]], until: int | None = None,
                    tag: int = 0) -> None:
        """
        Send frames (identifier with the flags of unix_frames.py, data) in their order.

        Frames of one kind, classic or CAN FD, that follow each other go out as one packet. Later
        than ``until``, ns of CLOCK_MONOTONIC, the hub passes none of them on.
        """
        head = b'' if until is None else can_frames.EXPIRY.pack(
            can_frames.EXPIRES, tag % can_frames.TAGS, until)
        for _, alike in groupby(frames, lambda frame: frame[0] & can_frames.FD):
            self._send_packet(head + b''.join([can_frames.to_bytes(*frame) for frame in alike]))

    def _send_packet(self, packet: bytes) -> None:
        try:
            try:
                self._socket.send(packet)
            except BlockingIOError:
                self._poll(select.POLLOUT, SENDING_MAY_TAKE)
                self._socket.send(packet)
        except OSError as error:
            raise can.CanOperationError(f'{self.channel_info}: {error}; the hub is gone or '
                                        'hangs') from error

    def recv_frames(self, timeout: float | None = None) -> list[tuple[int, bytes]]:
        """
        Return the frames of the next packet, or [] when none came within ``timeout`` seconds.

        Packets that are no frames are counted in ``refused`` and skipped.
        """
        if self._waiting:
            frames = list(self._waiting)
            self._waiting.clear()
            return frames
        try:
            try:
                packet = self._socket.recv(LARGEST)
            except BlockingIOError:
                self._poll(select.POLLIN, timeout)
                packet = self._socket.recv(LARGEST)
        except BlockingIOError:
            return []
        except OSError as error:
            raise can.CanOperationError(f'{self.channel_info}: {error}') from error
        if not packet:
            raise can.CanOperationError(f'{self.channel_info}: the hub has closed the connection')
        late = can_frames.expiry_of(packet)
        if late is not None:
            self.returned.append(late[0])
            return []
        try:
            return can_frames.from_bytes(packet)
        except can_frames.BadFrame:
            self.refused += 1
            return []

    def _poll(self, event: int, timeout: float | None) -> None:
        poll = select.poll()
        poll.register(self._socket, event)
        poll.poll(None if timeout is None else max(0.0, timeout) * 1e3)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one message."""
        self.send_frames([from_message(msg)])

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._waiting:
            self._waiting.extend(self.recv_frames(timeout))
        if not self._waiting:
            return None, False
        return to_message(*self._waiting.popleft(), time.time()), False

    def fileno(self) -> int:
        """Return the socket's descriptor, for select and asyncio."""
        return self._socket.fileno()

    def shutdown(self) -> None:
        """Leave the bus."""
        if self._open:
            self._open = False
            super().shutdown()
            self._socket.close()
