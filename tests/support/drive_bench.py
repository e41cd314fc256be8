"""
A driver's link beside the emulated drive of each protocol, without ROS, and what the bus says.

The meaning of the frames is read here by `struct`, from the vendors' documents and not by the
tables of the package: the bus is an oracle.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
import itertools
from pathlib import Path
from struct import unpack_from
from threading import Thread
from time import time_ns
from typing import Any

from bus_listener import BusListener
from driver_bench import wait_for
import numpy as np
import pytest

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire
from servo_rig_driver.can_bus.can_hub import CanHub
from servo_rig_driver.devices.drive_master import DriveMaster, DriveState
from servo_rig_driver.devices.protocols import PROTOCOLS
from servo_rig_driver.driver.driver_parameters import DECLARED, limits
from servo_rig_driver.driver.paced_requests import LinkSettings
from servo_rig_driver.driver.rig_health import RigHealth
from servo_rig_driver.driver.rig_link import RigLink
from servo_rig_driver.driver.sampler import Sampler
from servo_rig_driver.driver.setpoints import Mode, SetpointPlayer
from servo_rig_driver.emulated.drives.by_protocol import driver_parameters
from servo_rig_driver.emulated.rig_process import EmulatedRig

CONFIG = Path(__file__).resolve().parents[2] / 'config'
WATCHDOG = 1.0  # s; a busy machine stands still for longer than a drive's usual 0.1 s
EXTENDED, REMOTE, FD = 1 << 31, 1 << 30, 1 << 32
FAIL_ID = 0x7EF
OVER_TEMPERATURE = {'canopen': (0x4310, 'over-temperature of the motor'),
                    'odrive': (0x2000, 'motor over-temperature'),
                    'robstride': (0b100, 'over-temperature'),
                    'cybergear': (0b100, 'over-temperature'),
                    'cubemars': (6, 'over-temperature of the motor'),
                    'moteus': (38, 'over-temperature')}
"""A fault of each drive, and its words."""
NAMES = tuple(name for name in OVER_TEMPERATURE if name != 'cybergear')
"""One of each class; CyberGear is RobStride with another table."""
ASKED = tuple(name for name in NAMES if name != 'canopen')
"""Drives that are asked for each sample."""
SHORT = ('canopen', 'robstride')
"""One drive that is joined by SYNC and one that is asked: `make test` takes these alone."""
_channels = itertools.count()


def each(drives: Iterable[Any]) -> list[Any]:
    """
    Return drives for a test to be parametrized by; `make test-long` takes those not SHORT.

    A drive is a name, or a tuple that begins with one.
    """
    given = [one if isinstance(one, tuple) else (one,) for one in drives]
    return [pytest.param(*one, marks=[] if one[0] in SHORT else [pytest.mark.long])
            for one in given]


def parameters(name: str, **changed: Any) -> dict[str, Any]:
    """Return the driver's parameters of a shipped drive, by their dotted names."""
    of = {one.name: one.default for one in DECLARED}
    if name == 'canopen':
        of |= {'sync_period': 2e-3}
    else:
        file = 'robstride' if name == 'cybergear' else name
        of |= driver_parameters(CONFIG / 'drivers' / f'{file}.yaml')
    if name == 'cybergear':
        of['device.table'] = 'cybergear'
    silence = 3.0 if name == 'canopen' else 5.0  # a start waits for a quarter of it
    return of | {'retry_period': 0.1, 'listen_time': 0.05, 'fault_reset_pause': 0.1,
                 'command_timeout': 0.2, 'heartbeat_timeout': silence, 'enable_after_loss': True,
                 'device.watchdog': WATCHDOG} | changed


def rig_file(name: str) -> Path:
    """Return the rig that the emulated drive sits on."""
    other = {'canopen': 'rv_bench', 'cybergear': 'robstride'}
    return CONFIG / 'rigs' / f'{other.get(name, name)}.yaml'


def meaning(name: str, identifier: int, data: bytes) -> str | None:
    """Return what a frame on the bus of a drive says: drive, brake, off, clear, or None."""
    return _MEANINGS.get(name, _canopen)(identifier, data)


def _canopen(identifier: int, data: bytes) -> str | None:
    if identifier != 0x201:
        return None
    return {0x0F: 'drive', 0x02: 'brake', 0x00: 'off', 0x80: 'clear'}.get(data[0])


def _odrive(identifier: int, data: bytes) -> str | None:
    command = identifier - 32
    if command == 0x07:
        return {1: 'off', 8: 'enable'}.get(data[0])
    if command == 0x0D:
        return 'brake' if unpack_from('<f', data)[0] == 0.0 else 'drive'
    return {0x0C: 'drive', 0x0E: 'drive', 0x18: 'clear', 0x02: 'estop'}.get(command)


def _robstride(identifier: int, data: bytes) -> str | None:
    if not identifier & EXTENDED or identifier & 0xFF != 1:
        return None
    kind = identifier >> 24 & 0x1F
    if kind == 1:
        _, speed, kp, kd = unpack_from('>HHHH', data)
        torque = identifier >> 8 & 0xFFFF
        still = speed == kp == 0 or (abs(speed - 32767) < 2 and kp == 0)
        return 'brake' if still and kd and torque == 32767 else 'drive' if kd or kp else None
    return {3: 'enable', 4: 'clear' if data[0] else 'off'}.get(kind)


def _cubemars(identifier: int, data: bytes) -> str | None:
    if identifier != 1:
        return None
    last = {0xFC: 'enable', 0xFD: 'off', 0xFE: 'zero'}.get(data[7])
    if data[:7] == b'\xff' * 7 and last:
        return last
    bits = int.from_bytes(data, 'big')
    speed, kp, kd = bits >> 36 & 0xFFF, bits >> 24 & 0xFFF, bits >> 12 & 0xFFF
    if not kp and not kd:
        return None
    return 'brake' if not kp and abs(speed - 2047) < 2 else 'drive'


def _moteus(identifier: int, data: bytes) -> str | None:
    if identifier & 0xFFFF != 0x8001 or data[0] != 0x01 or data[1] != 0x00:
        return None
    return {0: 'off', 10: 'drive', 12: 'brake'}.get(data[2])


_MEANINGS = {'odrive': _odrive, 'robstride': _robstride, 'cybergear': _robstride,
             'cubemars': _cubemars, 'moteus': _moteus}


STOPS = {'canopen': (0x201, b'\x06\x00\xff'),  # "shutdown"
         'odrive': (0x27, b'\x01' + bytes(7)),  # Set_Axis_State, idle
         'robstride': (EXTENDED | 0x0400FD01, bytes(8)),
         'cybergear': (EXTENDED | 0x0400FD01, bytes(8)),
         'cubemars': (1, b'\xff' * 7 + b'\xfd'),
         'moteus': (FD | EXTENDED | 0x8201, b'\x01\x00\x00' + b'\x50' * 5)}
"""The frame by which another master takes the torque away, without a fault."""


class Wiretap(BusListener):
    """Keeps what the bus of a drive says, each meaning once as it changes."""

    def __init__(self, name: str, channel: str) -> None:
        self.name = name
        self.said: list[str] = []
        self.counts: dict[str, int] = {}
        super().__init__(channel, self._take)

    def _take(self, identifier: int, data: bytes) -> None:
        said = meaning(self.name, identifier, data)
        if said:
            self.counts[said] = self.counts.get(said, 0) + 1
            if self.said[-1:] != [said]:
                self.said.append(said)

    def forget(self) -> None:
        """Forget what the bus has said until now."""
        self.catch_up()
        self.said.clear()
        self.counts.clear()

    def fail(self, code: int) -> None:
        """Make the emulated drive fail with a code of its own."""
        if self.name == 'canopen':
            self.wire.send([(0x601, b'\x2b\x11\x20\x00' + code.to_bytes(4, 'little'))])
        else:
            self.wire.send([(FAIL_ID, code.to_bytes(4, 'little'))])


class Link:
    """A driver's link without ROS: parameters in, blocks of samples out."""

    def __init__(self, channel: str, of: dict[str, Any]) -> None:
        self.of = of
        self.health = RigHealth()
        self.blocks: list[Any] = []
        device, watch = PROTOCOLS[of['protocol']](of, self.health)
        self.player = SetpointPlayer(of['command_timeout'], limits(of))
        self.master = DriveMaster(of['fault_resets'], of['fault_reset_pause'],
                                  quick_stop=of['quick_stop_time'],
                                  after_loss=of['enable_after_loss'])
        self.device = device
        self.sampler = Sampler(device, self.player, self.master, watch, self.health,
                               round(of['answer_timeout'] * 1e9))
        settings = LinkSettings(round(of['sync_period'] * 1e9), 1, of['late_sync_limit'],
                                of['listen_time'], of['retry_period'])
        bus = BusSettings('unix_bus', channel, fd=device.fd)
        self.link = RigLink(settings, self.sampler, watch, self.health,
                            lambda: Wire(open_bus(bus, 5.0)), self.blocks.append, time_ns)

    def up(self) -> None:
        """Open, start, and wait until the drive follows."""
        self.link.open()
        self.link.start()
        self.enabled()

    def enabled(self) -> None:
        """Wait until the drive follows its reference."""
        try:
            wait_for(lambda: self.master.enabled and self.link.state == 'streaming' and self.blocks
                     and self.link.now() - self.blocks[-1].stamp < 50_000_000, 'it follows')
        except AssertionError as error:
            raise AssertionError(f'{error}: {self.link.state}, {self.device.state}, '
                                 f'{[t.text for t in self.health.troubles]}') from None

    def play(self, mode: int, reference: float, seconds: float = 0.5) -> None:
        """Queue a constant reference from now on."""
        now = self.link.now()
        self.player.add(now, mode, 0.01, [reference] * round(seconds * 100), [], now)

    def column(self, name: str) -> np.ndarray:
        """Return a column of all samples until now."""
        return np.concatenate([np.array(block.columns[name]) for block in list(self.blocks)])

    def says(self, words: str) -> None:
        """Wait until the health says these words."""
        try:
            wait_for(lambda: any(words in trouble.text for trouble in
                                 (*self.health.troubles, *self.health.past)), words)
        except AssertionError as error:
            raise AssertionError(f'{error}: {[t.text for t in self.health.troubles]}') from None

    @property
    def state(self) -> DriveState:
        """How the drive stands."""
        return self.device.state


class Bench:
    """Hub, emulated drive and wiretap of one protocol; ``rig`` is the emulated rig."""

    def __init__(self, name: str, channel: str, **changed: Any) -> None:
        self.name = name
        self.channel = channel
        self.of = parameters(name, **changed)
        self.supply_on()
        self.tap = Wiretap(name, channel)

    def supply_on(self) -> None:
        """Let the drive boot."""
        self.rig = EmulatedRig(rig_file(self.name), BusSettings('unix_bus', self.channel), seed=1,
                               driver=self.of, period=self.of['sync_period'])
        self.rig.listens = 0.0  # there is no other rig
        self._serving = Thread(target=self.rig.serve, daemon=True)
        self._serving.start()
        wait_for(self._booted, 'the drive has booted')

    def _booted(self) -> bool:
        try:
            self.rig.between_frames(lambda: None)
        except TimeoutError:
            return False
        return True

    def supply_off(self) -> None:
        """Let the drive lose its supply."""
        self.rig.stop()
        self._serving.join(5.0)

    def blink(self) -> None:
        """Let the drive lose its supply for so short a time that no answer is missing."""
        self.rig.between_frames(self.rig.nodes.restart)

    @property
    def pushes(self) -> bool:
        """Whether the motor has torque, as the emulated drive knows."""
        return self.rig.nodes.gives_torque

    def close(self) -> None:
        """Leave the bus."""
        self.tap.close()
        self.supply_off()


@contextmanager
def bench(name: str, folder: Path, **changed: Any) -> Iterator[Bench]:
    """Give a bus with the emulated drive of a protocol on it."""
    channel = str(folder / f'{name}{next(_channels)}.can')
    with CanHub(channel):
        made = Bench(name, channel, **changed)
        try:
            yield made
        finally:
            made.close()


@contextmanager
def linked(made: Bench, **changed: Any) -> Iterator[Link]:
    """Give a link to the drive of a bench, which is not opened yet."""
    link = Link(made.channel, made.of | changed)
    try:
        yield link
    finally:
        link.link.close()


@contextmanager
def driven(name: str, folder: Path, **changed: Any) -> Iterator[tuple[Bench, Link]]:
    """Give a bench and a link whose drive follows."""
    with bench(name, folder) as made, linked(made, **changed) as link:
        link.up()
        yield made, link


def turning(link, speed=1.0):
    """Let the motor turn, and wait until its samples say so."""
    speed = min(speed, link.of['limit.velocity'])

    def turns():
        link.play(Mode.VELOCITY, speed)
        angle = link.column('motor_position')[-60:]
        return np.ptp(angle) > 0.02
    wait_for(turns, 'the motor turns')
