"""
The thread between the driver and the bus: brings the rig up, keeps it asked, takes the answers.

    reopen ----> listen ----> wake ----> stream ----> idle
       ^            |           |          |           |
       |            +--> yield <+----------+    (start) wake
       +---- the bus is gone ---+----------+

``yield``: another driver speaks, so this one is silent until the other one is. ``wake``: the
device is started as its protocol has it; where two nodes have one id, ``refuse`` until stop().
While it streams, paced_requests.py says when each request is due. A drive that was let have torque
is not left, but for ``yield`` or ``refuse``, before it has told that it gives none.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
import os
import random
from threading import Event, Thread
from time import sleep

import can

from ..can_bus.bus_opening import Wire
from ..can_bus.bus_port import BusPort, Frames
from ..devices.device import Outcome
from ..devices.drive_master import STOPPED_BY_OTHER
from .paced_requests import LinkSettings, PacedRequests
from .rig_health import Level, RigHealth
from .rig_watch import RigWatch
from .sample_blocks import SampleBlock
from .sampler import Sampler
from .steady_clock import SteadyClock

SECOND = 1_000_000_000
CHECK_EVERY = SECOND // 50
FOREIGN_SILENCE = SECOND
DISABLING_MAY_TAKE = 0.8  # s from the end of the quick stop to a drive without torque
OUT_OF_REACH = 'was out of reach while the bus was gone, so that it may have lost its supply,'
WAKING_MAY_TAKE = 1.0  # s to the thread of the link on a busy machine
NOT_DOWN = ('the drive was told to give no torque and has not said since that it gives none: keep '
            'away from it, or take its supply away')


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
        self.settings = settings
        self.sampler = sampler
        self.watch = watch
        self.health = health
        self.state = 'closed'
        self._port = BusPort(open_wire, self._take, self._came_back, self._controller)
        self._clock = SteadyClock(clock)
        self.requests = PacedRequests(settings, sampler, health, self._port, self._clock, publish)
        self._checked = 0
        self._active = False
        self._down_until = 0  # when a drive that was told to go down has to be
        self._closing = False
        self._idle = Event()
        self._unheard = False  # whether the bus is gone, and nothing can be told to the drive
        self._thread = Thread(target=self._run, name='rig link', daemon=True)

    # Called from the node's thread.

    def open(self) -> None:
        """Open the bus; raises can.CanError, or ForeignDriver when another driver is there."""
        self._port.open()
        self._listen()
        if self.watch.foreign:
            self._port.close()
            raise ForeignDriver(f'another driver is on this bus, it sends {self.watch.foreign}; '
                                'two would fight over the drive, so this one stays away')
        self._thread.start()

    @property
    def broken(self) -> bool:
        """Whether its thread has ended by an error of this program, so that nothing starts it."""
        return self.state == 'broken'

    def start(self) -> None:
        """Bring the rig up and sample it, from now on and until stop()."""
        self.watch.foreign_stops = None
        self.watch.lost = ''
        self.sampler.master.begin()
        self._active = True

    def stop(self) -> bool:
        """
        Quick stop, then no torque, then no SYNC; return whether that was done in time.

        That takes ``quick_stop`` of the drive's master and DISABLING_MAY_TAKE at the most. A drive
        that does not say in that time that it gives no torque is told again until it does, and
        one whose bus is gone once the bus is there again.
        """
        self._down_until = self.now() + round(self._down_within * SECOND)
        self._active = False
        return self._idle.wait(self._down_within + WAKING_MAY_TAKE) and not self._unheard

    @property
    def _down_within(self) -> float:
        return self.sampler.master.quick_stop + DISABLING_MAY_TAKE

    def close(self) -> bool:
        """Stop, and leave the bus; return whether the drive has told that it gives no torque."""
        if self._thread.is_alive():
            self.stop()
            self._closing = True
            self._thread.join(5.0)
        self._port.close()
        self.state = 'closed'
        return not self.sampler.owes

    def now(self) -> int:
        """Return the time on the samples' clock, ns."""
        return self._clock.now()

    def stepped(self) -> int:
        """Return how far the ROS clock has been set forward since the link was made, ns."""
        return self._clock.stepped()

    # The thread.

    def _run(self) -> None:
        self._take_priority()
        phase = self._idling
        while not self._closing:
            try:
                phase = phase()
            except can.CanError as error:
                self.sampler.restart()
                self.watch.lost = OUT_OF_REACH
                self.health.trouble('bus.gone', f'the bus is gone: {error}', self.now())
                phase = self._reopening
            except Exception as error:
                self.state, self._unheard = 'broken', True
                self.health.trouble('bus.thread', f'the link has stopped: {error!r}; configure '
                                    'the driver again', self.now())
                with suppress(Exception):
                    self.requests.rest()
                self._idle.set()
                raise

    def _take_priority(self) -> None:
        if not self.settings.priority:
            return
        try:  # on Linux, 0 is the calling thread
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(self.settings.priority))
        except OSError as error:
            self.health.trouble('samples.priority', f'realtime_priority = {self.settings.priority}'
                                f' is not granted ({error.strerror}); SYNC may come late under '
                                'load', self.now(), Level.WARN)

    def _idling(self) -> Callable:
        self.state = 'idle'
        self.health.over('drive.not_down', self.now())
        self._idle.set()
        while not self._closing:
            self._port.receive(0.05)
            if self._active:
                if self._foreign_lately():
                    return self._yielding
                self.watch.foreign = ''
                return self._waking
        return self._idling

    def _reopening(self) -> Callable:
        self.state, self._unheard = 'waiting for the bus', True
        self._port.close()
        while not self._closing:
            if not self._active:
                self._idle.set()
            try:
                self._port.open()
            except can.CanError:
                sleep(min(0.05, self.settings.retry_period))
                continue
            try:
                self._listen()
            except can.CanError:  # an interface that is down opens, and fails then
                self._port.close()
                continue
            if self._wanted():
                self._unheard = False
                self.watch.silent(self.now())  # whether it was away for long
                return self._yielding if self.watch.foreign else self._waking
            if not self.watch.foreign:
                self.requests.rest()  # the drive may have gone on without the bus
            self._unheard = False
            self.health.over('bus.gone', self.now())
            return self._idling
        return self._reopening

    def _yielding(self) -> Callable:
        self.state = 'yielding to another driver'
        self.health.trouble('bus.foreign', f'another driver is on this bus, it sends '
                            f'{self.watch.foreign}; this one is silent until the other one is',
                            self.now())
        patience = FOREIGN_SILENCE + random.randrange(FOREIGN_SILENCE // 2)
        while self._active and self.now() - self.watch.foreign_at < patience:
            self._port.receive(0.05)
        self.watch.foreign = ''
        if self.watch.foreign_stops and self._active:
            self.sampler.master.hold(STOPPED_BY_OTHER)
        self.health.over('bus.foreign', self.now())
        if not self._active:
            self.sampler.let_go()
        return self._waking if self._active else self._idling

    def _waking(self) -> Callable:
        self.state = 'waiting for the rig'
        self._idle.clear()
        outcome = self.sampler.device.start(self._port, self.now, self._wanted)
        if outcome is Outcome.CALLED_OFF:
            self.requests.rest()
            return self._idling
        if outcome is Outcome.FOREIGN:
            return self._yielding
        if outcome is Outcome.DOUBLED:
            return self._refusing
        self._hold_lost()
        self.sampler.restart()
        self.watch.welcome(self.now())
        return self._streaming

    def _refusing(self) -> Callable:
        """Leave a bus with two nodes of one id alone until somebody has looked at it."""
        self.state = 'refusing a bus with two nodes of one id'
        who = ', '.join(self.watch.name(node) for node in self.sampler.device.doubled)
        self.health.trouble('nodes.doubled', f'two nodes of one id, or two rigs, are on this bus: '
                            f'{who} answers twice. Take one away or give it another id, then '
                            'deactivate and activate the driver; until then the drive stays off',
                            self.now())
        while self._active and not self._closing:
            self._port.receive(0.05)
        self.health.over('nodes.doubled', self.now())
        self.sampler.let_go()
        return self._idling

    def _streaming(self) -> Callable:
        self.requests.begin()
        self.state = 'streaming'
        self.sampler.master.enable = True
        while self._active:
            now = self.now()
            if self.requests.wait(now):
                continue
            self.requests.send(now)
            if now - self._checked > CHECK_EVERY:
                leave = self._check(now)
                if leave is not None:
                    return leave
        return self._winding_down

    def _check(self, now: int) -> Callable | None:
        self._checked = now
        self.sampler.check(now)
        self._hold_lost()
        if self.watch.foreign:
            self.requests.rest()
            return self._yielding
        if self._must_wake(now):
            self.requests.rest()
            return self._waking
        return None

    def _hold_lost(self) -> None:
        why, self.watch.lost = self.watch.lost, ''
        if why:
            self.sampler.master.lost(why)

    def _must_wake(self, now: int) -> bool:
        """Tell whether the device has to be started again, and say why."""
        if self.watch.restarted:
            self.health.event('nodes.restart', f'{self.watch.restarted} has restarted', now)
            return True
        if self.watch.silent(now):  # which it has named
            return True
        if self.sampler.answered_twice(now):
            self.health.event('nodes.twice', 'requests are answered twice: a second node of one '
                              'id has come, or the drive sends unasked; it is started again', now)
            self.watch.doubtful = True
            return True
        if self.requests.stuck:
            self.watch.lost = self.watch.lost or self.sampler.device.loss(now)
            self.health.event('samples.stuck', f'{self.sampler.waiting} requests are not '
                              'answered in full; the device is started again', now)
        return self.requests.stuck

    def _winding_down(self) -> Callable:
        self.state = 'taking the drive down'
        self.sampler.master.enable = False
        while not self.sampler.down and not self._closing:
            now = self.now()
            leave = self._must_leave(now) if now > self._down_until else None
            if leave is not None:
                return leave
            if not self.requests.wait(now):
                self.requests.send(now)
        self.requests.rest()
        if self.sampler.down:
            self.sampler.let_go()
        return self._idling

    def _must_leave(self, now: int) -> Callable | None:
        """Return what is next where a drive that is to go down has not said in time that it is."""
        if self._active:  # by somebody who could not wait for it
            self.requests.rest()
            return self._waking
        self._wanted()
        return self._check(now) if now - self._checked > CHECK_EVERY else None

    def _wanted(self) -> bool:
        """Whether the device is to be asked: it is to run, or has yet to say that it is down."""
        if self._active or self._closing or not self.sampler.owes:
            return self._active
        if self.now() > self._down_until:
            self.health.trouble('drive.not_down', f'{NOT_DOWN}; it is told again until it says '
                                'so', self.now())
        return True

    def _listen(self) -> None:
        self.watch.foreign = ''
        until = self.now() + int(self.settings.listen_time * SECOND)
        while self.now() < until and not self.watch.foreign:
            self._port.receive(0.02)

    def _foreign_lately(self) -> bool:
        return bool(self.watch.foreign) and self.now() - self.watch.foreign_at < FOREIGN_SILENCE

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
