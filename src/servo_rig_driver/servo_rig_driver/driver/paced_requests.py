"""
Requests to a drive at a steady pace, each with what the drive shall hold from then on.

Request k is due at ``origin + k * period``, an absolute deadline on the steady clock, and goes out
in one packet with its set-point. The age of a set-point is judged at the instant of sending, and
the packet says until when it may be passed on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..can_bus.bus_port import BusPort
from .rig_health import RigHealth
from .sample_blocks import BlockBuilder, SampleBlock
from .sampler import Sampler
from .steady_clock import SteadyClock

SECOND = 1_000_000_000
UNANSWERED_AT_MOST = 2 * SECOND


@dataclass(frozen=True)
class LinkSettings:
    """How the link keeps time; ``period`` in ns, all others in s."""

    period: int
    block_size: int
    late_limit: float
    listen_time: float
    retry_period: float
    priority: int = 0


class PacedRequests:
    """
    The requests of one rig over one bus; all times in ns.

    ``latest`` is the most by which a request went out late. ``publish`` gets each full block of
    samples. Numbers go on over all pauses: those of requests that were not made are left out.
    """

    def __init__(self, settings: LinkSettings, sampler: Sampler, health: RigHealth, port: BusPort,
                 clock: SteadyClock, publish: Callable[[SampleBlock], None]) -> None:
        self.latest = 0
        self._settings = settings
        self._sampler = sampler
        self._health = health
        self._port = port
        self._clock = clock
        self._publish = publish
        self._origin: int | None = None
        self._next = 0

    def begin(self) -> None:
        """Begin to count a period from now, or go on with the number that is due now."""
        if self._origin is not None:
            self._skip_to(self._clock.now())
            return
        period = self._settings.period
        self._origin = self._clock.now() + period
        self._sampler.blocks = BlockBuilder(self._settings.block_size, self._origin, period,
                                            self._publish)

    @property
    def _due(self) -> int:
        return self._origin + self._next * self._settings.period

    @property
    def stuck(self) -> bool:
        """Whether requests have waited too long for all of their answers."""
        return self._sampler.waiting * self._settings.period > UNANSWERED_AT_MOST

    def wait(self, now: int) -> bool:
        """Wait for the next instant, or for frames, where it is not yet time to ask."""
        if now < self._due:
            self._port.receive((self._due - now) * 1e-9)
            return True
        return False

    def send(self, now: int) -> None:
        """
        Make the request that is due, or skip those that are too late.

        Frames are taken first where it is late by more than a period.
        """
        due = self._due
        if now - due > self._settings.period:
            self._port.receive(0.0)
        now = self._clock.now()
        if now - due > self._settings.late_limit * SECOND:
            self._skip_to(now)
            return
        self.latest = max(self.latest, now - due)
        number, self._next = self._next, self._next + 1
        frames = self._sampler.tick(number, due, now)
        if frames is None:
            return
        frames, until = self._sampler.judged(frames, self._clock.now())
        self._port.send(frames, until and self._clock.steady(until), number)

    def rest(self) -> None:
        """Send what leaves the drive without torque and unasked."""
        self._port.send(self._sampler.rest(self._next, self._clock.now()))

    def _skip_to(self, now: int) -> None:
        ahead = -(-(now - self._origin) // self._settings.period)
        if ahead > self._next:
            self._health.count('samples.not_asked', ahead - self._next)
            self._health.event('samples.skipped', f'{ahead - self._next} samples were not taken, '
                               f'up to number {ahead}', now)
            self._next = ahead
