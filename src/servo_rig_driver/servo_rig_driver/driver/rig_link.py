"""The driver's hold on its rig: opened, started, stopped, closed, while a thread serves it."""

from __future__ import annotations

from collections.abc import Callable
import os
from threading import Thread

import can

from ..can_bus.bus_opening import Wire
from ..can_bus.bus_port import BusPort, Frames
from .left_on import LeftOn
from .link_states import FOREIGN_SILENCE, LinkStates
from .paced_requests import LinkSettings, PacedRequests
from .rig_health import Level, RigHealth
from .rig_watch import RigWatch
from .sample_blocks import SampleBlock
from .sampler import Sampler
from .steady_clock import SteadyClock

SECOND = 1_000_000_000
STEPPED = SECOND // 10
"""ns by which the ROS clock may have been set before the stamps of samples are called off."""
DISABLING_MAY_TAKE = 0.8  # s from the end of the quick stop to a drive without torque
WAKING_MAY_TAKE = 1.0  # s to the thread of the link on a busy machine


class ForeignDriver(RuntimeError):
    """Another driver speaks on the bus."""


class RigLink:
    """
    Runs one rig over one bus in a thread of its own.

    ``clock`` returns the ROS time in ns and is asked once: all stamps follow the steady clock from
    then on. ``publish`` gets each full block of samples, in the link's thread.
    """

    def __init__(self, settings: LinkSettings, sampler: Sampler, watch: RigWatch,
                 health: RigHealth, open_wire: Callable[[], Wire],
                 publish: Callable[[SampleBlock], None], clock: Callable[[], int]) -> None:
        self.sampler = sampler
        self.watch = watch
        self.health = health
        self._port = BusPort(open_wire, self._take, self._came_back, self._controller)
        self._clock = SteadyClock(clock)
        self.requests = PacedRequests(settings, sampler, health, self._port, self._clock, publish)
        self._states = LinkStates(settings, sampler, watch, health, self._port, self._clock,
                                  self.requests)
        self._left_on = LeftOn(sampler, self._port, health, self._clock.now)
        self._priority = settings.priority
        self._thread = Thread(target=self._serve, name='rig link', daemon=True)

    def open(self) -> None:
        """
        Open the bus, and take the torque away from a drive that nobody leads.

        Raises can.CanError, or ForeignDriver when another driver is there.
        """
        self._port.open()
        try:
            self._states.listen()
            if self.watch.foreign:
                raise ForeignDriver('another driver is on this bus, it sends '
                                    f'{self.watch.foreign}; two would fight over the drive, so '
                                    'this one stays away')
            self._left_on.begin(self._states.settings.listen_time)
        except (can.CanError, ForeignDriver):
            self._port.close()
            raise
        self._thread.start()

    @property
    def state(self) -> str:
        """What it does now, in words."""
        return self._states.state

    @property
    def broken(self) -> bool:
        """Whether its thread has ended by an error of this program, so that nothing starts it."""
        return self.state == 'broken'

    def start(self) -> None:
        """Bring the rig up and sample it, from now on and until stop()."""
        self.watch.foreign_stops = None
        self.watch.lost = ''
        self.sampler.master.begin()
        self._states.active = True

    def stop(self) -> bool:
        """
        Quick stop, then no torque, then no SYNC; return whether that was done in time.

        That takes ``quick_stop`` of the drive's master and DISABLING_MAY_TAKE at the most. A drive
        that does not say in that time that it gives no torque is told again until it does, and
        one whose bus is gone once the bus is there again.
        """
        self._states.down_until = self.now() + round(self._down_within * SECOND)
        self._states.active = False
        rests = self._states.idle.wait(self._down_within + WAKING_MAY_TAKE)
        return rests and not self._states.unheard

    @property
    def _down_within(self) -> float:
        return self.sampler.master.quick_stop + DISABLING_MAY_TAKE

    def close(self) -> bool:
        """Stop, and leave the bus; return whether the drive has told that it gives no torque."""
        if self._thread.is_alive():
            self.stop()
            self._states.closing = True
            self._thread.join(5.0)
            if not self.watch.foreign_within(FOREIGN_SILENCE, self.now()):
                self._left_on.rest()
        self._port.close()
        self._states.state = 'closed'
        return not self.sampler.owes

    def look(self) -> None:
        """Say where the drive has torque without this link, and where the clock was set."""
        self._left_on.look(self.state == 'idle')
        stepped = self.stepped()
        if abs(stepped) < STEPPED:
            self.health.over('samples.clock', self.now())
            return
        self.health.trouble(
            'samples.clock', f'the clock was set by {stepped / SECOND:+.1f} s, or the machine '
            'slept, since the driver was configured: samples are stamped by the clock before, so '
            'that they do not fit those of other nodes; clean the driver up and configure it '
            'again', self.now(), Level.WARN)

    def now(self) -> int:
        """Return the time on the samples' clock, ns."""
        return self._clock.now()

    def stepped(self) -> int:
        """Return how far the ROS clock has been set forward since the link was made, ns."""
        return self._clock.stepped()

    def _serve(self) -> None:
        self._take_priority()
        self._states.run()

    def _take_priority(self) -> None:
        if not self._priority:
            return
        try:  # on Linux, 0 is the calling thread
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(self._priority))
        except OSError as error:
            self.health.trouble('samples.priority', f'realtime_priority = {self._priority} '
                                f'is not granted ({error.strerror}); SYNC may come late under '
                                'load', self.now(), Level.WARN)

    def _take(self, received: Frames) -> None:
        if self.health.has('bus.gone'):  # nobody is heard on a bus that is gone
            self.health.over('bus.gone', self.now())
        self.sampler.take(received, self.now())

    def _controller(self, said: str) -> None:
        if said:
            self.health.trouble('bus.controller', said, self.now())
        else:
            self.health.over('bus.controller', self.now())

    def _came_back(self, number: int) -> None:
        self.sampler.withdraw(number, self.now())
