"""The driver's end of the bus: waits for frames with a resolution of microseconds."""

from __future__ import annotations

from collections.abc import Callable
import select

from .bus_opening import Wire

Frames = list[tuple[int, bytes]]


class BusPort:
    """
    A bus that may be opened again and again; ``take`` gets the frames that came in.

    All but close() raise can.CanError when the bus is gone.
    """

    def __init__(self, open_wire: Callable[[], Wire], take: Callable[[Frames], None]) -> None:
        self._open_wire = open_wire
        self._take = take
        self._wire: Wire | None = None
        self._descriptor: int | None = None

    def open(self) -> None:
        """Open the bus."""
        self._wire = self._open_wire()
        try:
            self._descriptor = self._wire.bus.fileno()
        except NotImplementedError:
            self._descriptor = None

    def close(self) -> None:
        """Leave the bus; closing twice does no harm."""
        wire, self._wire = self._wire, None
        if wire is not None:
            wire.bus.shutdown()

    def send(self, frames: Frames) -> None:
        """Send frames in their order."""
        self._wire.send(frames)

    def receive(self, timeout: float) -> None:
        """Take the frames that come next, waiting up to ``timeout`` s for the first."""
        if self._descriptor is not None:
            if timeout > 0.0:
                # python-can waits in whole milliseconds, as poll(2) does
                ready, _, _ = select.select([self._descriptor], [], [], timeout)
                if not ready:
                    return
            timeout = 0.0
        received = self._wire.recv(timeout)
        if received:
            self._take(received)
