"""
A moteus controller: one CAN FD frame writes the command and reads the state.

All commands use its position mode, whose watchdog then guards each of them; a pure current is a
feed-forward torque with both gains scaled to zero. Source: mjbots moteus, docs/protocol.
"""

from __future__ import annotations

from contextlib import suppress
from math import isfinite, isnan, nan, tau

from ..can_bus.bus_port import Frames
from ..can_bus.unix_frames import EXTENDED, FD
from ..driver.limits import Mode, Setpoint
from ..driver.rig_watch import RigWatch
from .device import DeviceError
from .drive_master import DriveState, Order
from .drive_settings import DriveSettings
from .moteus_registers import FAULTED, identifier, MoteusTable, padded, TIMEOUT
from .on_request import NO_ANSWER, OnRequest
from .pdo_table import FrameError

ROUND = 2.0**31 * 1e-3
"""Seconds that its counter of milliseconds holds: 31 bits, from 0 or from the lowest number."""
FORWARD = 3600.0
"""Seconds by which the counter may go on from one answer to the next: no silence lasts longer."""
HOSTS = 0x7F
LIMITING = 96
"""From this `fault` on, a code says what limits the power, and is none."""


class Moteus(OnRequest):
    """One controller, by a table of registers."""

    fd = True
    tells_restart = True

    def __init__(self, table: MoteusTable, settings: DriveSettings, watch: RigWatch) -> None:
        super().__init__(settings, watch)
        if settings.host > HOSTS:
            raise DeviceError(f'device.host = {settings.host}; a moteus answers hosts up to '
                              f'{HOSTS}: the bit above asks for the answer')
        self.table = table
        self._uptime: float | None = None  # as it was told last, s
        self._to_drive = identifier(settings.host, settings.node, reply=True)
        self._reads = table.read(table.reads)
        self._top = table.registers['position'].top

    def forget_told(self) -> None:
        """Forget that a position was held, and that a watchdog ran out."""
        self._holds = False  # whether the last command closed the position loop
        self.missed = False

    def _frame(self, values: dict[str, float]) -> Frames:
        return [(self._to_drive, padded(self.table.write(values) + self._reads))]

    def query(self) -> Frames:
        """Return a frame that reads alone."""
        return self._frame({})

    def off(self) -> Frames:
        """Return the stop command."""
        return self._frame({'mode': self.table.modes['stopped']})

    def frames(self, order: Order, point: Setpoint | None, now: int) -> Frames:
        """Return the command and the request in one frame."""
        if self.up(order) or order is Order.ENABLE:
            return self._frame(self._command(order, point))
        if self.clears(order):
            self.missed = False
            return self.off()
        if self._state is DriveState.FAULT and not self.missed:  # a stop command would clear it
            return self.query()
        return self.off()

    def _command(self, order: Order, point: Setpoint | None) -> dict[str, float]:
        own = self.settings
        if order is Order.QUICK_STOP:
            return {'mode': self.table.modes['zero_velocity'], 'watchdog_timeout': own.watchdog}
        held, position, velocity, torque, gains = self._holds, nan, 0.0, 0.0, 0.0
        if point is not None and point.mode is Mode.CURRENT:
            torque = point.reference * own.torque_per_ampere
        elif point is not None and point.mode is Mode.VELOCITY:
            velocity, gains = point.reference / tau, 1.0
            if not held:  # its position loop would go on from where it was closed last
                position = self.reading.motor_position / own.ratio / tau
                held = not isnan(position)  # else it stays open, and the speed alone is held
        elif point is not None and point.mode is Mode.POSITION:
            position, gains, held = point.reference / tau, 1.0, True
        loop = gains if held else 0.0
        self._holds = loop > 0.0
        return {'mode': self.table.modes['position'], 'command_position': position,
                'command_velocity': velocity, 'feedforward_torque': torque,
                'kp_scale': loop, 'kd_scale': gains, 'watchdog_timeout': own.watchdog,
                'ilimit_scale': loop}

    @property
    def no_position(self) -> str:
        """Why no position is given: its shaft is where the register of the position ends."""
        if not (self._heard_at and isnan(self.reading.motor_position)):
            return ''
        return (f"joint '{self.settings.joint}' does not tell where it stands, as from "
                f'{self._top * tau:.6g} rad on, where its register ends. Turn it back by a '
                'velocity or a current, or set its zero with the tool of the drive')

    def unsent(self) -> None:
        """Do nothing: each frame says all."""

    def hear(self, identifier: int, data: bytes) -> int | None:
        """Keep what a reply tells."""
        if not identifier & FD or (identifier & ~(FD | EXTENDED)) != (
                self.settings.node << 8 | self.settings.host):
            return None
        told, _ = self.table.parse(data)
        if any(one.name not in told for one in self.table.reads):
            return NO_ANSWER
        if not (isfinite(told['mode']) and isfinite(told['fault'])):
            raise FrameError(f'the drive tells mode {told["mode"]} and fault {told["fault"]}')
        mode, code = int(told['mode']), int(told['fault'])
        self._state = DriveState[self.table.states.get(mode, 'unknown').upper()]
        if self._started_again(told.get('uptime')):
            self.watch.booted(self.settings.node)
            self._note_loss(self.watch.lost)
            self._state = DriveState.UNKNOWN  # so that it is told to stop, whatever it obeyed
        self._fault = ''
        stopped = self._state is DriveState.SWITCH_ON_DISABLED
        self.missed = mode == TIMEOUT or self.missed and stopped
        if self.missed:
            if stopped:  # a timeout may have torque; the stop that takes it away is no reset yet
                self._state = DriveState.FAULT
            self._fault = self.table.timeout
        elif mode == FAULTED or 0 < code < LIMITING:
            self._fault = self.table.faults.get(code, f'fault code {code}')
        own, reading = self.settings, self.reading
        turns = told['position'] if abs(told['position']) < self._top else nan  # held at its end
        reading.motor_position = turns * tau * own.ratio
        reading.load_speed = told['velocity'] * tau
        reading.current = told['q_current']
        reading.current_reference = told['control_torque'] / own.torque_per_ampere
        reading.temperature = told['temperature']
        return 0

    def _started_again(self, uptime: float | None) -> bool:
        """Whether its counter went back, which begins again after ROUND as well."""
        before, self._uptime = self._uptime, uptime
        return None not in (before, uptime) and (uptime - before) % ROUND > FORWARD

    def foreign(self, identifier: int, data: bytes) -> str:
        """Return the frame that another driver sent to this drive."""
        number = identifier & ~(FD | EXTENDED)
        if not identifier & FD or number & 0xFF != self.settings.node:
            return ''
        return f'a command (0x{number:04X})'

    def stops(self, identifier: int, data: bytes) -> bool | None:
        """Whether a mode is written that follows no command, or one that does."""
        with suppress(FrameError, ValueError):  # a mode may be no number
            mode = self.table.parse(data)[0].get('mode')
            if mode is not None:
                follows = self.table.states.get(int(mode)) == 'operation_enabled'
                return not follows or mode == self.table.modes['zero_velocity']
        return None
