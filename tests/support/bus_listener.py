"""Hears all frames of a rig's bus in a thread of its own."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread

from can import CanError

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire


class BusListener:
    """Calls ``hear`` with the identifier and data of each frame; ``wire`` sends as well."""

    def __init__(self, channel: str, hear: Callable[[int, bytes], None]) -> None:
        self.wire = Wire(open_bus(BusSettings('unix_bus', channel), 20.0))
        self._hear = hear
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
                self._hear(identifier, data)

    def close(self) -> None:
        """Leave the bus."""
        self._stop.set()
        self._thread.join(5.0)
        self.wire.bus.shutdown()
