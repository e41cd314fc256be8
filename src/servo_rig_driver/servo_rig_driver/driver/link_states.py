"""
The states of the link between driver and bus, and what leads from one to the next.

    reopen ----> listen ----> wake ----> stream ----> idle
       ^            |           |          |           |
       |            +--> yield <+----------+    (start) wake
       +---- the bus is gone ---+----------+

``yield``: another driver speaks, so this one is silent until the other one is. ``wake``: the
device is started as its protocol has it; where two nodes have one id, ``refuse`` until it is no
longer wanted. While it streams, paced_requests.py says when each request is due. A drive that
was let have torque is not left, but for ``yield`` or ``refuse``, before it has told that it gives
none.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
import random
from threading import Event
from time import sleep

import can

from ..can_bus.bus_port import BusPort
from ..devices.device import Outcome
from ..devices.drive_master import STOPPED_BY_OTHER
from .paced_requests import LinkSettings, PacedRequests
from .rig_health import RigHealth
from .rig_watch import RigWatch
from .sampler import Sampler
from .steady_clock import SteadyClock
from .waking import must_wake

SECOND = 1_000_000_000
CHECK_EVERY = SECOND // 50
FOREIGN_SILENCE = SECOND
OUT_OF_REACH = 'was out of reach while the bus was gone, so that it may have lost its supply,'
NOT_DOWN = ('the drive was told to give no torque and has not said since that it gives none: keep '
            'away from it, or take its supply away')


class LinkStates:
    """
    The states of one link; all of it runs in the link's thread, each state is a method.

    Another thread sets ``active``: whether the rig is to be sampled; ``down_until``: the instant,
    ns, at which a drive that is no longer to be sampled has to be down; ``closing``: whether all
    ends. ``idle`` is set while the drive is left alone, ``unheard`` while the bus is gone and
    nothing can be told to the drive.
    """

    def __init__(self, settings: LinkSettings, sampler: Sampler, watch: RigWatch,
                 health: RigHealth, port: BusPort, clock: SteadyClock,
                 requests: PacedRequests) -> None:
        self.settings = settings
        self.sampler = sampler
        self.watch = watch
        self.health = health
        self.requests = requests
        self.state = 'closed'
        self.active = False
        self.closing = False
        self.down_until = 0
        self.idle = Event()
        self.unheard = False
        self.now = clock.now
        self._port = port
        self._checked = 0

    def run(self) -> None:
        """Go from state to state until it closes."""
        phase = self._idling
        while not self.closing:
            try:
                phase = phase()
            except can.CanError as error:
                self.sampler.restart()
                self.watch.lost = OUT_OF_REACH
                self.health.trouble('bus.gone', f'the bus is gone: {error}', self.now())
                phase = self._reopening
            except Exception as error:
                self.state, self.unheard = 'broken', True
                self.health.trouble('bus.thread', f'the link has stopped: {error!r}; configure '
                                    'the driver again', self.now())
                with suppress(Exception):
                    self.requests.rest()
                self.idle.set()
                raise

    def _idling(self) -> Callable:
        self.state = 'idle'
        self.health.over('drive.not_down', self.now())
        self.idle.set()
        while not self.closing:
            self._port.receive(0.05)
            if self.active:
                if self.watch.foreign_within(FOREIGN_SILENCE, self.now()):
                    return self._yielding
                self.watch.foreign = ''
                return self._waking
        return self._idling

    def _reopening(self) -> Callable:
        self.state, self.unheard = 'waiting for the bus', True
        self._port.close()
        while not self.closing:
            if not self.active:
                self.idle.set()
            try:
                self._port.open()
            except can.CanError:
                sleep(min(0.05, self.settings.retry_period))
                continue
            try:
                self.listen()
            except can.CanError:  # an interface that is down opens, and fails then
                self._port.close()
                continue
            if self._wanted():
                self.unheard = False
                self.watch.silent(self.now())  # whether it was away for long
                return self._yielding if self.watch.foreign else self._waking
            if not self.watch.foreign:
                self.requests.rest()  # the drive may have gone on without the bus
            self.unheard = False
            self.health.over('bus.gone', self.now())
            return self._idling
        return self._reopening

    def _yielding(self) -> Callable:
        self.state = 'yielding to another driver'
        self.health.trouble('bus.foreign', f'another driver is on this bus, it sends '
                            f'{self.watch.foreign}; this one is silent until the other one is',
                            self.now())
        patience = FOREIGN_SILENCE + random.randrange(FOREIGN_SILENCE // 2)
        while self.active and self.now() - self.watch.foreign_at < patience:
            self._port.receive(0.05)
        self.watch.foreign = ''
        if self.watch.foreign_stops and self.active:
            self.sampler.master.hold(STOPPED_BY_OTHER)
        self.health.over('bus.foreign', self.now())
        if not self.active:
            self.sampler.let_go()
        return self._waking if self.active else self._idling

    def _waking(self) -> Callable:
        self.state = 'waiting for the rig'
        self.idle.clear()
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
        while self.active and not self.closing:
            self._port.receive(0.05)
        self.health.over('nodes.doubled', self.now())
        self.sampler.let_go()
        return self._idling

    def _streaming(self) -> Callable:
        self.requests.begin()
        self.state = 'streaming'
        self.sampler.master.enable = True
        while self.active:
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
        if must_wake(self.watch, self.sampler, self.requests, self.health, now):
            self.requests.rest()
            return self._waking
        return None

    def _hold_lost(self) -> None:
        why, self.watch.lost = self.watch.lost, ''
        if why:
            self.sampler.master.lost(why)

    def _winding_down(self) -> Callable:
        self.state = 'taking the drive down'
        self.sampler.master.enable = False
        while not self.closing:
            if self.sampler.proves_down(self._port, self.now, lambda: not self.closing):
                self.sampler.let_go()
                break
            now = self.now()
            leave = self._must_leave(now) if now > self.down_until else None
            if leave is not None:
                return leave
            if not self.requests.wait(now):
                self.requests.send(now)
        self.requests.rest()
        return self._idling

    def _must_leave(self, now: int) -> Callable | None:
        """Return what is next where a drive that is to go down has not said in time that it is."""
        if self.active:  # by somebody who could not wait for it
            self.requests.rest()
            return self._waking
        self._wanted()
        return self._check(now) if now - self._checked > CHECK_EVERY else None

    def _wanted(self) -> bool:
        """Whether the device is to be asked: it is to run, or has yet to say that it is down."""
        if self.active or self.closing or not self.sampler.owes:
            return self.active
        if self.now() > self.down_until:
            self.health.trouble('drive.not_down', f'{NOT_DOWN}; it is told again until it says '
                                'so', self.now())
        return True

    def listen(self) -> None:
        """Hear for a while whether another driver is on the bus."""
        self.watch.foreign = ''
        until = self.now() + int(self.settings.listen_time * SECOND)
        while self.now() < until and not self.watch.foreign:
            self._port.receive(0.02)
