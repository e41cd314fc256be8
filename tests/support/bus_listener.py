"""Hears all frames of a rig's bus in a thread of its own."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread
from time import monotonic, sleep

from can import CanError

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire

MARK = 0x7E4  # an identifier that nobody else uses
TURNS = 5  # of the hub, which takes a packet of each client in turn


class BusListener:
    """Calls ``hear`` with the identifier and data of each frame; ``wire`` sends as well."""

    def __init__(self, channel: str, hear: Callable[[int, bytes], None]) -> None:
        self.channel = channel
        self.wire = Wire(open_bus(BusSettings('unix_bus', channel), 20.0))
        self._hear = hear
        self._marks = 0
        self._stop = Event()
        self._thread = Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        while not self._stop.is_set():
            try:
                frames = self.wire.recv(0.05)
            except CanError:
                return
            for identifier, data in frames:
                if identifier == MARK:
                    self._marks += 1
                else:
                    self._hear(identifier, data)

    def catch_up(self) -> None:
        """Wait until it has heard all that was sent before; a busy machine hears it late."""
        marker = Wire(open_bus(BusSettings('unix_bus', self.channel), 20.0))
        try:
            for _ in range(TURNS):
                heard, deadline = self._marks, monotonic() + 60.0
                marker.send([(MARK, b'')])
                while self._marks == heard:
                    assert monotonic() < deadline, 'a mark on the bus: not heard within 60 s'
                    sleep(0.001)
        finally:
            marker.bus.shutdown()

    def close(self) -> None:
        """Leave the bus."""
        self._stop.set()
        self._thread.join(5.0)
        self.wire.bus.shutdown()
