"""
The hub of a Unix bus: what one client sends, all the others get, in one order for all.

    python -m servo_rig_driver.can_bus.can_hub /run/user/1000/rig.can

A packet that holds no CAN frames is refused, told once a client and counted. One that comes too
late goes back to its sender: no old set-point may reach a drive. A client that stops reading is
let go once BACKLOG packets wait for it, so that no frame is lost without a word and the others
are never held up. The hub may be stopped and started again; clients open the bus again.
"""

from __future__ import annotations

import argparse
from collections import deque
import logging
from math import inf
from pathlib import Path
import selectors
import socket
from threading import Thread
from time import monotonic, monotonic_ns

from ..ending import Ending
from ..free_output import free_output
from . import unix_frames as can_frames
from .unix_bus import check_path, listening

BACKLOG = 200_000
HEAD = can_frames.EXPIRY.size
LARGEST = can_frames.LARGEST + HEAD + 1  # one more: too long is seen
LINGERS = 3.0  # s
STOP, LOOK = b'.', b'?'

log = logging.getLogger('can_hub')


class _Client:

    def __init__(self, number: int, connection: socket.socket) -> None:
        self.number = number
        self.socket = connection
        self.waiting: deque[tuple[bytes, float]] = deque()  # and until when, ns
        self.refused = 0


class CanHub:
    """
    Serves the bus whose socket is ``path``.

    ``passed``, ``refused``, ``late`` (given back) and ``overdue`` (of one client) count packets,
    ``dropped`` clients that did not read. Raises OSError where another hub serves, or what is no
    socket lies; a socket left by a killed hub is replaced.
    """

    def __init__(self, path: str) -> None:
        self.path = Path(check_path(path))
        self.passed = self.refused = self.dropped = 0
        self.late = self.overdue = 0
        self._clients: dict[int, _Client] = {}
        self._joined = 0
        self._ends_at: float | None = None
        self._selector = selectors.DefaultSelector()
        self._listener = self._listen()
        self._bell, self._rope = socket.socketpair()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._bell, selectors.EVENT_READ)
        self._thread: Thread | None = None

    def _listen(self) -> socket.socket:
        if self.path.exists():
            if not self.path.is_socket():  # it refuses a connection as a dead socket does
                raise FileExistsError(f'{self.path} is no socket, and no bus takes its place; '
                                      'choose another path, or remove it')
            with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
                try:
                    probe.connect(str(self.path))
                except ConnectionRefusedError:
                    self.path.unlink()
                else:
                    raise OSError(f'another hub already serves {self.path}')
        return listening(self.path)

    def serve(self) -> None:
        """Pass frames on until stop() is called from another thread or a signal handler."""
        while True:
            left = None if self._ends_at is None else self._ends_at - monotonic()
            if left is not None and (left <= 0.0 or not self._clients):
                self._close()
                return
            for key, events in self._selector.select(left):
                if key.fileobj is self._bell:
                    if STOP in self._bell.recv(64):
                        self._close()
                        return
                    continue
                if key.fileobj is self._listener:
                    self._join()
                    continue
                if events & selectors.EVENT_WRITE:
                    self._flush(key.data)
                if events & selectors.EVENT_READ and key.data.number in self._clients:
                    self._take(key.data)

    def stop(self) -> None:
        """Make serve() return; safe to call from a signal handler, and twice."""
        try:
            self._rope.send(STOP)
        except OSError:
            return

    def end(self) -> None:
        """
        Make serve() return when the last client has left, at most LINGERS s from now.

        A wire does not end before those on it: a driver still has to take its drive down.
        """
        self._ends_at = monotonic() + LINGERS
        try:
            self._rope.send(LOOK)
        except OSError:
            return

    def __enter__(self) -> CanHub:
        """Serve in a thread, for a bus within a test or a tool."""
        self._thread = Thread(target=self.serve, name=f'hub {self.path}', daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Stop serving."""
        self.stop()
        self._thread.join()

    def _join(self) -> None:
        connection, _ = self._listener.accept()
        connection.setblocking(False)
        self._joined += 1
        client = _Client(self._joined, connection)
        self._clients[client.number] = client
        self._selector.register(connection, selectors.EVENT_READ, client)
        self._give(client, can_frames.GREETING)

    def _leave(self, client: _Client) -> None:
        self._selector.unregister(client.socket)
        client.socket.close()
        del self._clients[client.number]

    def _take(self, client: _Client) -> None:
        try:
            packet = client.socket.recv(LARGEST)
        except BlockingIOError:
            return
        except ConnectionResetError:
            return  # it left packets unread; what it sent before is still to be read
        except OSError:
            packet = b''
        if not packet:
            self._leave(client)
            return
        expiry = can_frames.expiry_of(packet)
        head, packet = (b'', packet) if expiry is None else (packet[:HEAD], packet[HEAD:])
        try:
            can_frames.from_bytes(packet)
        except can_frames.BadFrame as error:
            self.refused += 1
            client.refused += 1
            if client.refused == 1:
                log.error('refused from client %d: %s', client.number, error)
            return
        until = inf if expiry is None else expiry[1]
        if monotonic_ns() > until:
            self.late += 1
            self._give(client, head)
            return
        self.passed += 1
        for other in list(self._clients.values()):
            if other is not client:
                self._give(other, packet, until)

    def _give(self, client: _Client, packet: bytes, until: float = inf) -> None:
        if not client.waiting:
            try:
                client.socket.send(packet)
                return
            except BlockingIOError:
                self._selector.modify(client.socket,
                                      selectors.EVENT_READ | selectors.EVENT_WRITE, client)
            except OSError:
                return  # it has gone; what it said before is still to be read, and then its end
        client.waiting.append((packet, until))
        if len(client.waiting) > BACKLOG:
            self.dropped += 1
            log.error('client %d let go: it left %d packets unread, at most %d may wait',
                      client.number, len(client.waiting), BACKLOG)
            self._leave(client)

    def _flush(self, client: _Client) -> None:
        try:
            while client.waiting:
                packet, until = client.waiting[0]
                if monotonic_ns() <= until:
                    client.socket.send(packet)
                else:
                    self.overdue += 1
                client.waiting.popleft()
        except BlockingIOError:
            return
        except OSError:
            client.waiting.clear()  # it has gone; what it said before is still to be read
        self._selector.modify(client.socket, selectors.EVENT_READ, client)

    def _close(self) -> None:
        for client in list(self._clients.values()):
            self._leave(client)
        self._selector.close()
        self._listener.close()
        self._bell.close()
        self._rope.close()
        self.path.unlink(missing_ok=True)


def main(arguments: list[str] | None = None) -> int:
    """Serve one bus until a signal or the end of its parent."""
    parser = argparse.ArgumentParser(description='The hub of a CAN bus over a Unix socket.')
    parser.add_argument('path', help='path of the socket, as in the channel of the bus')
    path = parser.parse_args(arguments).path
    free_output()
    logging.basicConfig(format='can_hub: %(message)s', level=logging.INFO)
    try:
        hub = CanHub(path)
    except (OSError, ValueError) as error:
        log.error('%s', error)
        return 1
    Ending(hub.end)
    log.info('serving %s', path)
    hub.serve()
    log.info('%d packets passed, %d refused, %d too late, %d clients let go', hub.passed,
             hub.refused, hub.late + hub.overdue, hub.dropped)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
