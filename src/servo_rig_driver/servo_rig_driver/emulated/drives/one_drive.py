"""
What the emulated drives have in common: a machine that lives by requests, loops, a watchdog.

A request lets one sample period pass, as SYNC does for the CANopen nodes; within it the drive's
loops run at their own rate. Silence is counted in real time.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
import logging
from typing import ClassVar

import numpy as np

from ...devices.drive_settings import DriveSettings
from .. import rig_sampling
from ..emulated_bench import Bench, COMMANDS

FAIL_ID = 0x7EF
"""On this identifier an emulated drive takes a fault code, four bytes little-endian, and fails."""
COMPILED_STEP = 0.02  # s of the machine at most in one go

Send = Callable[[list[tuple[int, bytes]]], None]
log = logging.getLogger('emulated_rig')


class OneDrive(ABC):
    """
    One drive on one machine; ``send`` takes a list of frames.

    ``syncs`` counts the requests answered, ``refused`` the frames that were no frames of it.
    ``rate`` is that of its loops, Hz.
    """

    fd: ClassVar[bool] = False
    """Whether the bus has to be CAN FD."""
    slowest_beat: ClassVar[float] = 0.0
    """Up to how many s, beyond those that a rig listens first, its beats are apart."""

    def __init__(self, bench: Bench, settings: DriveSettings, rate: float, send: Send) -> None:
        self.bench = bench
        self.settings = settings
        self.send = send
        self.syncs = 0
        self.refused = 0
        self.watchdog = settings.watchdog
        self._cycles = max(1, round(bench.period * rate))
        self._period = bench.period
        self._heard: float | None = None
        self.last = np.zeros(rig_sampling.ANSWERS)

    def restart(self) -> None:
        """Lose the supply for a moment: what is not stored is as at the start."""
        self.watchdog = self.settings.watchdog
        self._heard = None
        self.power_on()

    @abstractmethod
    def power_on(self) -> None:
        """Stand as after a start: no torque, and nothing told yet."""

    @property
    @abstractmethod
    def gives_torque(self) -> bool:
        """Whether the motor may have current."""

    @abstractmethod
    def command(self) -> tuple[float, ...]:
        """Return what the loops work on, by the columns of rig_sampling.py."""

    @abstractmethod
    def hear(self, identifier: int, data: bytes, now: float) -> bool:
        """Take a frame; whether it was for this drive."""

    @abstractmethod
    def own(self, identifier: int, data: bytes) -> str:
        """Return what this drive is called where it alone sends such a frame; '' for others."""

    @abstractmethod
    def starved(self) -> None:
        """Do what the drive does when its watchdog has heard nothing."""

    @abstractmethod
    def fail(self, code: int) -> None:
        """Go to fault with a code."""

    @abstractmethod
    def beat(self, now: float) -> None:
        """Say what the drive says by itself from time to time."""

    def boot(self) -> None:
        """Begin on a bus where nothing has been heard yet; a motor with torque is watched on."""
        if not self.gives_torque:
            self._heard = None

    def take(self, identifier: int, data: bytes, now: float) -> None:
        """Answer one frame; what is not for the drive is ignored."""
        if identifier == FAIL_ID and len(data) == 4:
            self.fail(int.from_bytes(data, 'little'))
            log.warning('the drive failed with code 0x%X', int.from_bytes(data, 'little'))
        elif self.hear(identifier, data, now):
            self._heard = now

    def tick(self, now: float) -> None:
        """See whether requests have stopped; the machine then goes on in real time."""
        self.beat(now)
        if self._heard is None or now - self._heard <= self.watchdog:
            return
        if self.gives_torque:
            log.warning('the drive has heard nothing for %g s', now - self._heard)
            self.starved()
        elapsed, self._heard = min(now - self._heard, 1.0), now
        self._pass(elapsed, 1)

    def step(self) -> np.ndarray:
        """Latch the sensors, take over the command and let one sample period pass."""
        self.syncs += 1
        return self._pass(self._period, self._cycles)

    def _pass(self, duration: float, cycles: int) -> np.ndarray:
        cycles = max(cycles, int(duration / COMPILED_STEP) + 1)
        self.bench.period = duration / cycles
        row = np.zeros(COMMANDS)
        given = self.command()
        row[:len(given)] = given
        self.last = self.bench.record(np.tile(row, (cycles, 1)))[0]
        return self.last

    @property
    def torque_per_ampere(self) -> float:
        """Torque of the machine at the load for one ampere, N m/A."""
        values = self.bench.rig.values
        return values['machine.torque_constant'] * values['machine.ratio']

    @property
    def load_angle(self) -> float:
        """What the drive's one encoder makes of the load's angle, rad."""
        return self.last[rig_sampling.MOTOR] / self.bench.rig.values['machine.ratio']

    @property
    def load_speed(self) -> float:
        """What the drive makes of the load's speed, rad/s."""
        return self.last[rig_sampling.SPEED] / self.bench.rig.values['machine.ratio']
