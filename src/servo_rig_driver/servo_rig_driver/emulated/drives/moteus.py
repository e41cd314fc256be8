"""An emulated moteus controller: registers over CAN FD around the machine."""

from __future__ import annotations

from math import isnan, nan, tau
import time

from ...can_bus.unix_frames import EXTENDED, FD
from ...devices.drive_settings import DriveSettings
from ...devices.moteus_registers import (
    FAULTED,
    MoteusTable,
    padded,
    REPLY_WANTED,
    TIMEOUT,
)
from ...devices.moteus_registers import (
    identifier as frame_identifier,
)
from ...devices.pdo_table import FrameError
from .. import rig_sampling
from ..emulated_bench import Bench
from .one_drive import OneDrive, Send

LOOP_RATE = 15_000.0  # Hz; servo.pwm_rate_hz can be 15 to 60 kHz
SUPPLY = 24.0  # V


class EmulatedMoteus(OneDrive):
    """One controller; its position loop takes its gains from the loops of the rig file."""

    fd = True

    def __init__(self, bench: Bench, table: MoteusTable, settings: DriveSettings, send: Send
                 ) -> None:
        super().__init__(bench, settings, LOOP_RATE, send)
        self.table = table
        self.timeout_mode = table.modes['stopped']  # servo.timeout_mode, as docs/driver.md asks
        self.power_on()
        values = bench.rig.values
        self._kd = (values['drive.velocity_gain'] * values['drive.gain']
                    * self.torque_per_ampere)
        self._kp = values['drive.position_gain'] * self._kd

    def power_on(self) -> None:
        """Stand stopped, and count milliseconds from 0."""
        self.mode = self.table.modes['stopped']
        self.code = 0
        self._control: float | None = None  # position of the loop, rad at the load
        self._told: dict[str, float] = {}
        self._started = time.monotonic()

    @property
    def gives_torque(self) -> bool:
        """Whether a mode with torque is on."""
        return self._acts in (self.table.modes['position'], self.table.modes['zero_velocity'])

    @property
    def _acts(self) -> int:
        return self.timeout_mode if self.mode == TIMEOUT else self.mode

    def command(self) -> tuple[float, ...]:
        """Return the position loop as an impedance, or zero speed."""
        if not self.gives_torque:
            return (rig_sampling.OFF,)
        if self._acts == self.table.modes['zero_velocity']:
            return rig_sampling.IMPEDANCE_MODE, 0.0, 0.0, 0.0, 0.0, self._kd, 0.0
        told = self._told
        return (rig_sampling.IMPEDANCE_MODE, self._control or 0.0, 0.0,
                told.get('command_velocity', 0.0) * tau,
                self._kp * told.get('kp_scale', 1.0), self._kd * told.get('kd_scale', 1.0),
                told.get('feedforward_torque', 0.0))

    def hear(self, identifier: int, data: bytes, now: float) -> bool:
        """Take a frame for this controller, and reply where that is wanted."""
        number = identifier & ~(FD | EXTENDED)
        if not identifier & FD or number & 0xFF != self.settings.node:
            return False
        try:
            written, asked = self.table.parse(data)
        except FrameError:
            self.refused += 1
            return False
        if written:
            self._obey(written)
        if number & REPLY_WANTED and asked:
            reply = self.table.reply(self._registers([one.name for one in asked]))
            self.send([(frame_identifier(self.settings.node, number >> 8 & 0x7F), padded(reply))])
        return True

    def _obey(self, written: dict[str, float]) -> None:
        if 'mode' in written:
            mode = int(written['mode'])
            if mode == self.table.modes['stopped']:
                self.code, self.mode = 0, mode
            elif self.mode not in (FAULTED, TIMEOUT):
                if mode != self.mode:
                    self._control = None
                self.mode = mode
        timeout = written.get('watchdog_timeout', 0.0)
        if timeout > 0.0:
            self.watchdog = timeout
        self._told = written
        position = written.get('command_position', nan)
        if not isnan(position):
            self._control = position * tau
        elif self._control is None:
            self._control = self.load_angle

    def _registers(self, names: list[str]) -> dict[str, float]:
        out = self.step()
        if self.mode == self.table.modes['position'] and self._control is not None:
            self._control += self._told.get('command_velocity', 0.0) * tau * self._period
        per_ampere = self.torque_per_ampere
        told = {'mode': self.mode, 'position': self.load_angle / tau,
                'velocity': self.load_speed / tau,
                'torque': out[rig_sampling.CURRENT] * per_ampere,
                'q_current': out[rig_sampling.CURRENT], 'voltage': SUPPLY,
                'temperature': out[rig_sampling.TEMPERATURE], 'fault': self.code,
                'uptime': time.monotonic() - self._started,
                'control_torque': out[rig_sampling.CURRENT_REFERENCE] * per_ampere}
        return {name: told.get(name, nan) for name in names}

    def own(self, identifier: int, data: bytes) -> str:
        """Return that a controller sends what comes from this id."""
        return 'controller' if identifier & FD and identifier >> 8 & 0x7F == self.settings.node \
            else ''

    def beat(self, now: float) -> None:
        """Say nothing: it speaks when it is asked."""

    def starved(self) -> None:
        """Latch the timeout; a stop command ends it."""
        self.mode = TIMEOUT

    def fail(self, code: int) -> None:
        """Go to the fault mode with a code."""
        self.mode, self.code = FAULTED, code
