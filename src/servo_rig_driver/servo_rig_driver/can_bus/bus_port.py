"""The driver's end of the bus: waits for frames with a resolution of microseconds."""

from __future__ import annotations

from collections.abc import Callable
import select

from .bus_opening import Wire

Frames = list[tuple[int, bytes]]


class BusPort:
    """
    A bus that may be opened again and again.

    ``take`` gets the frames that came in, ``late`` the tag of each packet that was sent and came
    back, since it was too late; ``wrong`` what the controller says is wrong with it, as that
    changes, '' for nothing. All but close() raise can.CanError when the bus is gone.
    """

    def __init__(self, open_wire: Callable[[], Wire], take: Callable[[Frames], None],
                 late: Callable[[int], None] = lambda tag: None,
                 wrong: Callable[[str], None] = lambda said: None) -> None:
        self._open_wire = open_wire
        self._take = take
        self._late = late
        self._wrong = wrong
        self._said = ''
        self._wire: Wire | None = None
        self._descriptor: int | None = None

    def open(self) -> None:
        """Open the bus."""
        self._wire = self._open_wire()
        try:
            self._descriptor = self._wire.bus.fileno()
        except NotImplementedError:
            self._descriptor = None

    @property
    def opened(self) -> bool:
        """Whether the bus was opened, and not left since."""
        return self._wire is not None

    def close(self) -> None:
        """Leave the bus; closing twice does no harm."""
        wire, self._wire = self._wire, None
        if wire is not None:
            wire.bus.shutdown()

    def send(self, frames: Frames, until: int | None = None, tag: int = 0) -> None:
        """Send frames in their order, none of them after ``until``, as Wire.send() has it."""
        self._wire.send(frames, until, tag)

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
        for tag in self._wire.late():
            self._late(tag)
        said = self._wire.controller
        if said is not None and said != self._said:
            self._said = said
            self._wrong(said)
        if received:
            self._take(received)
