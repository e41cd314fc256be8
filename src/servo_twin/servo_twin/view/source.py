"""Where the view takes its samples from: a running rig, or a bag that is played."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from ..physics.servo import Servo
from ..recording.events import Happened
from ..recording.recording import Recording
from .traces import Traces

EVENTS = 200
"""Events that are kept, the newest ones."""


class Refused(ValueError):
    """What somebody asked for in the page cannot be; the text says why."""


class Source(ABC):
    """
    What is looked at: samples in ``traces``, and facts beside them.

    ``kind`` is `rig` or `bag`. All methods are called by the thread of the server.
    """

    kind: str

    def __init__(self) -> None:
        self.traces = Traces()

    @abstractmethod
    def look(self, wanted: bool) -> None:
        """Begin to work because somebody looks, or rest because nobody does any more."""

    @abstractmethod
    def advance(self) -> None:
        """Do what a tick of the server, some 30 a second while somebody looks, is due for."""

    @abstractmethod
    def facts(self) -> dict[str, Any]:
        """Return what the page tells beside the samples, by the name of its part, for JSON."""

    @abstractmethod
    def servo(self) -> Servo | None:
        """Return the servo that is looked at, where it is known; its values may have moved on."""

    @abstractmethod
    def events(self) -> list[Happened]:
        """Return what happened, oldest first, at most EVENTS."""

    @abstractmethod
    def recording(self, seconds: float) -> Recording:
        """
        Return the last seconds with the servo file that the twin runs; may take a while.

        Called by a thread of its own. Raises ValueError where there is too little, or no servo.
        """

    async def set_value(self, path: str, value: float) -> None:
        """Give the twin another value; raises Refused."""
        raise Refused(f'{path} = {value:g}: a bag that is played has no twin that could change')

    def play(self, playing: bool | None, at: float | None) -> None:
        """Play or pause, and go to a second of the recording; raises Refused."""
        raise Refused('a running rig can be neither paused nor wound back')

    @abstractmethod
    def close(self) -> None:
        """Give everything up."""
