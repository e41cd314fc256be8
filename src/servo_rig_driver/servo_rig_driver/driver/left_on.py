"""
A drive that has torque though no driver leads it.

A driver that was killed leaves it so where the drive has no watchdog of its own, as several are
delivered, and so does a tool that has ended.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import can

from ..can_bus.bus_port import BusPort
from ..devices.drive_master import DriveState, FOLLOWS
from .rig_health import RigHealth
from .sampler import Sampler

SECOND = 1_000_000_000
ANSWER_MAY_TAKE = SECOND // 20
ECHO = SECOND // 50  # ns for what is answered to a frame that takes the torque away
FAILED = (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)
"""States in which a stop frame is kept back: it may clear the fault, and what the drive says."""


class LeftOn:
    """
    Takes the torque away from a drive that nobody leads, and says that the drive had some.

    ``now`` returns the time in ns. Who calls it has listened that no other driver speaks.
    """

    def __init__(self, sampler: Sampler, port: BusPort, health: RigHealth,
                 now: Callable[[], int]) -> None:
        self._device = sampler.device
        self._sampler, self._port, self._health, self._now = sampler, port, health, now

    def begin(self, listened: float) -> None:
        """Ask the drive how it stands, after a silence of ``listened`` s, and have it rest."""
        device = self._device
        frames = device.query()
        if frames:
            self._port.send(frames)
            self._receive(ANSWER_MAY_TAKE, lambda: device.state is not DriveState.UNKNOWN)
        had_torque = device.state in FOLLOWS
        self.rest()
        if frames:
            self._receive(ECHO, lambda: False)
        if had_torque:
            self._tell(listened)

    def _receive(self, long: int, enough: Callable[[], bool]) -> None:
        until = self._now() + long
        while self._now() < until and not enough():
            self._port.receive(0.005)

    def _tell(self, listened: float) -> None:
        watchdog = 2 * self._device.silence / SECOND
        had = ('the drive had torque though no driver leads it, as where a driver was killed or a '
               'tool left it so; the torque was taken away')
        if not 0.0 < watchdog < listened:
            self._health.event('drive.found_on', had, self._now(), lasts=60.0)
            return
        self._health.trouble(
            'drive.watchdog', f'{had}. Nobody on this bus has spoken to it for {listened:g} s, '
            f'and device.watchdog = {watchdog:g} s: its own watchdog is not set, so that a driver '
            'that is killed leaves the motor running. Set it with the tool of the drive',
            self._now())

    def rest(self) -> None:
        """Take the torque away, where the bus is there and the drive is in no fault."""
        if self._device.state not in FAILED and self._port.opened:
            with suppress(can.CanError):
                self._port.send(self._sampler.rest(0, self._now()))

    def look(self, idle: bool) -> None:
        """Say where a drive tells that it has torque while the link is ``idle``."""
        if idle and self._device.settled and self._device.state in FOLLOWS:
            self._health.trouble(
                'drive.left_on', 'the drive tells that it has torque, and this driver does not '
                'lead it: another program or a start of its own has enabled it. Activate and '
                'deactivate the driver, or clean it up, to take the torque away', self._now())
        else:
            self._health.over('drive.left_on', self._now())
