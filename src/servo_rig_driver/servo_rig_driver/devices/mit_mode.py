"""
Actuators in MIT mode (RobStride, CyberGear, CubeMars): five numbers out, a state back.

The drive's own law, at its output shaft and at its own rate, is

    torque = kp (position - measured) + kd (velocity - measured) + feed-forward

so that each command of this driver is a choice of these five. Source: the vendors' manuals, named
in devices/tables. One table a model holds identifiers, bits and ranges; this class knows none.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from math import nan

from ..can_bus.bus_port import Frames
from ..can_bus.unix_frames import EXTENDED
from ..driver.limits import Mode, Setpoint
from ..driver.rig_watch import RigWatch
from .device import DeviceError
from .drive_master import DriveState, Order
from .drive_settings import DriveSettings
from .mit_table import FIELDS, MitTable
from .on_request import OnRequest
from .pdo_table import FrameError

LIMP = 'gives no torque though it is asked for some, as after a loss of its supply,'
LIMP_AFTER = 200_000_000  # ns
ASKS, GIVES, SLOW = 0.1, 0.01, 0.1
"""Shares of the ranges: torque is asked for above the first and not given below the second."""
_ZERO = {'position': 0.0, 'velocity': 0.0, 'kp': 0.0, 'kd': 0.0, 'torque': 0.0}


class MitMode(OnRequest):
    """One actuator in MIT mode, by its table."""

    silent_watchdog = True

    def __init__(self, table: MitTable, settings: DriveSettings, watch: RigWatch) -> None:
        self.table = table
        super().__init__(settings, watch)
        self.tells_state = bool(table.states)
        self._ids = {'drive': settings.node, 'host': settings.host}
        self._flag = EXTENDED if table.extended else 0
        for name in table.commands:  # ids that do not fit, before a motor turns
            table.frames[name].pack(dict.fromkeys(FIELDS, 0.0) | self._ids)
        for name, gain, field in (('kp', settings.kp, 'kp'), ('kd', settings.kd, 'kd'),
                                  ('brake', settings.brake, 'kd')):
            top = table.ranges[field].high
            if gain > top:
                raise DeviceError(f'device.{name} = {gain:g} is beyond what {table.name} carries, '
                                  f'[0, {top:g}]; the drive would be told {top:g}')

    def forget_told(self) -> None:
        """Forget the turns counted, the last command and the watchdog that was told."""
        self._turns = 0.0
        self._last_angle: float | None = None
        self._five = _ZERO
        self._obeyed_at = 0
        self.unsent()

    def _frame(self, name: str, **values: float) -> Frames:
        self._sent = name
        identifier, data = self.table.frames[name].pack(self._ids | values)
        return [(identifier | self._flag, data)]

    def query(self) -> Frames:
        """Return a command of zero torque, which every state answers."""
        return self._frame('control', **_ZERO)

    def off(self) -> Frames:
        """Return the stop frame."""
        return self._frame('stop')

    def frames(self, order: Order, point: Setpoint | None, now: int) -> Frames:
        """
        Return the one frame that gives the order; the drive answers each.

        Before it is enabled, and once it is, it is told the time of its watchdog, where a model
        takes it over the bus: one that started again has forgotten it.
        """
        if order is Order.ENABLE and not self._watched:
            return self._frame('watchdog', time=round(
                self.settings.watchdog * self.table.watchdog_rate))
        if self.up(order):
            self._five = self._law(order, point)
            return self._frame('control', **self._five)
        if order is Order.ENABLE:
            return self._frame('enable')
        if self.clears(order):
            return self._frame('clear')
        if self._state is DriveState.FAULT:  # a stop frame might clear it
            return self.query()
        return self.off()

    def _law(self, order: Order, point: Setpoint | None) -> dict[str, float]:
        own = self.settings
        if order is Order.QUICK_STOP:
            return _ZERO | {'kd': own.brake}
        if point is None or point.mode is Mode.OFF:
            return _ZERO
        if point.mode is Mode.CURRENT:
            return _ZERO | {'torque': point.reference * own.torque_per_ampere}
        if point.mode is Mode.VELOCITY:
            return _ZERO | {'velocity': point.reference, 'kd': own.kd}
        return _ZERO | {'position': point.reference, 'kp': own.kp, 'kd': own.kd}

    def carried(self) -> dict[Mode, tuple[float, float]]:
        """Return the ranges of the table, those of torque in A."""
        ranges, scale = self.table.ranges, self.settings.torque_per_ampere
        return {mode: (ranges[name].low / unit, ranges[name].high / unit) for mode, name, unit in (
            (Mode.CURRENT, 'torque', scale), (Mode.VELOCITY, 'velocity', 1.0),
            (Mode.POSITION, 'position', 1.0))}

    def unsent(self) -> None:
        """Tell the watchdog again; each other frame says all."""
        self._watched = 'watchdog' not in self.table.frames

    def hear(self, identifier: int, data: bytes) -> int | None:
        """Keep what a feedback frame tells."""
        if bool(identifier & EXTENDED) != self.table.extended:
            return None
        told = self.table.frames['feedback'].unpack(identifier & ~EXTENDED, data)
        if told is None or any(told.get(who, number) != number
                               for who, number in self._ids.items()):
            return None
        was = self._state
        self._state, self._fault = self.table.state(told, was)
        if self._state is not was:
            self.unsent()
        own, reading = self.settings, self.reading
        reading.motor_position = self._unwrapped(told['position']) * own.ratio
        reading.load_speed = told['velocity']
        reading.current = told['torque'] / own.torque_per_ampere
        reading.temperature = told['temperature']
        if not self.tells_state and self._state is DriveState.OPERATION_ENABLED and (
                self._disobeys(told)):
            self._state = DriveState.UNKNOWN  # so that it is told to stop
            self._note_loss(LIMP)
        return 0

    def _disobeys(self, told: Mapping[str, float]) -> bool:
        """
        Whether it has told for LIMP_AFTER that it gives no torque where its law gives some.

        One that turns fast is not judged: its supply may carry no more torque there.
        """
        five, ranges = self._five, self.table.ranges
        top, fast = ranges['torque'].high, SLOW * ranges['velocity'].high
        asked = (five['torque'] + five['kp'] * (five['position'] - told['position'])
                 + five['kd'] * (five['velocity'] - told['velocity']))
        if (abs(asked) < ASKS * top or abs(told['torque']) > GIVES * top
                or abs(told['velocity']) > fast or not self._obeyed_at):
            self._obeyed_at = self._asked_at
        return self._asked_at - self._obeyed_at > LIMP_AFTER

    def obeyed(self, said: str) -> None:
        """Take over what a frame leads to: the state, where answers do not tell it."""
        self._watched |= said == 'watchdog'
        if not self.tells_state:
            self._state = self.table.led_to(said, self._state)

    def _unwrapped(self, angle: float) -> float:
        """
        Return the angle with its turns counted, where the field goes on at its other end.

        A field that is held at its ends says nothing there: NaN.
        """
        ends = self.table.ranges['position']
        if not self.table.wraps and not ends.low < angle < ends.high:
            return nan
        if self.table.wraps:
            span = ends.high - ends.low
            if self._last_angle is not None and abs(angle - self._last_angle) > 0.5 * span:
                self._turns += span if angle < self._last_angle else -span
            self._last_angle = angle
        return angle + self._turns

    def foreign(self, identifier: int, data: bytes) -> str:
        """Return which of a driver's frames was heard."""
        if bool(identifier & EXTENDED) != self.table.extended:
            return ''
        for name in self.table.commands:
            frame = self.table.frames[name]
            told = frame.identifier.unpack(identifier & ~EXTENDED)
            if told is not None and told.get('drive') == self._ids['drive'] \
                    and len(data) == frame.length:
                return f'{name} (0x{identifier & ~EXTENDED:X})'
        return ''

    def stops(self, identifier: int, data: bytes) -> bool | None:
        """Whether it is the stop frame, or the one that enables."""
        for name, says in (('stop', True), ('clear', True), ('enable', False)):
            with suppress(FrameError):
                told = self.table.frames[name].unpack(identifier & ~EXTENDED, data)
                if told is not None:
                    return says
        return None
