"""
Actuators in MIT mode (RobStride, CyberGear, CubeMars): five numbers out, a state back.

The drive's own law, at its output shaft and at its own rate, is

    torque = kp (position - measured) + kd (velocity - measured) + feed-forward

so that each command of this driver is a choice of these five. Source: the vendors' manuals, named
in devices/tables. One table a model holds identifiers, bits and ranges; this class knows none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
import struct

from ..can_bus.bus_port import BusPort, Frames
from ..can_bus.unix_frames import EXTENDED
from ..driver.limits import Mode, Setpoint
from ..driver.rig_watch import RigWatch
from .counted_turns import CountedTurns
from .device import DeviceError, Outcome
from .drive_master import DriveState, Order
from .drive_settings import DriveSettings
from .mit_table import FIELDS, MitTable
from .on_request import NO_ANSWER, OnRequest
from .pdo_table import FrameError

LIMP = 'gives no torque though it is asked for some, as after a loss of its supply,'
LIMP_AFTER = 200_000_000  # ns
ASKS, GIVES, SLOW = 0.1, 0.01, 0.1
"""Shares of the ranges: torque is asked for above the first and not given below the second."""
EDGE = 0.02
"""Share of the range of positions in which none is commanded: a load could turn it beyond."""
TRIES = 3
"""How often a drive that answers may leave out its turns before it is taken to tell none."""
_ZERO = {'position': 0.0, 'velocity': 0.0, 'kp': 0.0, 'kd': 0.0, 'torque': 0.0}


class MitMode(OnRequest):
    """One actuator in MIT mode, by its table."""

    silent_watchdog = True

    def __init__(self, table: MitTable, settings: DriveSettings, watch: RigWatch) -> None:
        self.table = table
        ends = table.ranges['position']
        self.turns = CountedTurns(ends, table.wraps)
        self._unseen = 0.5e9 * (ends.high - ends.low) / table.ranges['velocity'].high
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
        """Forget the last command and the watchdog that was told; start() begins the turns."""
        self._five = _ZERO
        self._obeyed_at = 0
        self.unsent()

    def start(self, port: BusPort, now: Callable[[], int], wanted: Callable[[], bool]) -> Outcome:
        """Ask until the drive answers, and where it stands beyond the range of its angle."""
        self.turns.begin(asking='turns' in self.table.frames)
        outcome = super().start(port, now, wanted)
        tries, late = TRIES, False
        while self.turns.asking and outcome is Outcome.STARTED and tries:
            if not wanted():
                return Outcome.CALLED_OFF
            if self.watch.foreign:
                return Outcome.FOREIGN
            answered = self._asked(port, now) > 0
            tries, late = tries - answered, late or not answered
        if late:  # as after the first question, a late answer would be that to the first sample
            self._quiet(port, now, wanted)
        self.turns.give_up()
        return outcome

    @property
    def no_position(self) -> str:
        """Why a position means nothing to the drive as its shaft stands, and what to do."""
        return self.turns.no_position(self.settings.joint, self.table.name)

    def _frame(self, name: str, **values: float) -> Frames:
        self._sent = name
        identifier, data = self.table.frames[name].pack(self._ids | values)
        return [(identifier | self._flag, data)]

    def query(self) -> Frames:
        """Return a command of zero torque, which every state answers."""
        return self._turns_asked() + self._frame('control', **_ZERO)

    def _turns_asked(self) -> Frames:
        """Return the question for the counted angle, as long as it is open."""
        if not self.turns.asking:
            return []
        identifier, data = self.table.frames['turns'].pack(self._ids)
        return [(identifier | self._flag, data)]

    def off(self) -> Frames:
        """Return the stop frame."""
        return self._frame('stop')

    def frames(self, order: Order, point: Setpoint | None, now: int) -> Frames:
        """
        Return the one frame that gives the order; the drive answers each.

        The question for its turns goes before it as long as it is open. Before the drive is
        enabled, and once it is, it is told the time of its watchdog, where a model takes it over
        the bus: one that started again has forgotten it.
        """
        if order is Order.ENABLE and not self._watched:
            return self._frame('watchdog', time=round(
                self.settings.watchdog * self.table.watchdog_rate))
        if self.up(order):
            self._five = self._law(order, point)
            return self._turns_asked() + self._frame('control', **self._five)
        if order is Order.ENABLE:
            return self._frame('enable')
        if self.clears(order):
            return self._frame('clear')
        if self._state is DriveState.FAULT:  # a stop frame might clear it
            return self.query()
        return self._turns_asked() + self.off()

    def _law(self, order: Order, point: Setpoint | None) -> dict[str, float]:
        own = self.settings
        if order is Order.QUICK_STOP:
            return _ZERO | {'kd': own.brake}
        if point is None or point.mode is Mode.OFF or (
                point.mode is Mode.POSITION and not self.turns.commandable):
            return _ZERO
        if point.mode is Mode.CURRENT:
            return _ZERO | {'torque': point.reference * own.torque_per_ampere}
        if point.mode is Mode.VELOCITY:
            return _ZERO | {'velocity': point.reference, 'kd': own.kd}
        return _ZERO | {'position': point.reference, 'kp': own.kp, 'kd': own.kd}

    def carried(self) -> dict[Mode, tuple[float, float]]:
        """Return the ranges of the table, those of torque in A; of positions all but EDGE."""
        ranges, scale = self.table.ranges, self.settings.torque_per_ampere
        return {mode: (ranges[name].low / unit, ranges[name].high / unit) for mode, name, unit in (
            (Mode.CURRENT, 'torque', scale), (Mode.VELOCITY, 'velocity', 1.0),
            (Mode.POSITION, 'position', 1.0 / (1.0 - EDGE)))}

    def unsent(self) -> None:
        """Tell the watchdog again; each other frame says all."""
        self._watched = 'watchdog' not in self.table.frames

    def hear(self, identifier: int, data: bytes) -> int | None:
        """Keep what a feedback frame tells, and the counted angle before it."""
        if bool(identifier & EXTENDED) != self.table.extended:
            return None
        if self._hear_turns(identifier & ~EXTENDED, data):
            return NO_ANSWER
        told = self.table.frames['feedback'].unpack(identifier & ~EXTENDED, data)
        if told is None or any(told.get(who, number) != number
                               for who, number in self._ids.items()):
            return None
        was = self._state
        self._state, self._fault = self.table.state(told, was)
        if self._state is not was:
            self.unsent()
            if self._state is DriveState.OPERATION_ENABLED:  # it may have started again
                self.turns.ask(lost=False)
        own, reading = self.settings, self.reading
        if self._heard_at and self._asked_at - self._heard_at > self._unseen:
            self.turns.ask(lost=True)
        reading.motor_position = self.turns.angle(told['position']) * own.ratio
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

    def _hear_turns(self, identifier: int, data: bytes) -> bool:
        """Keep the angle that the drive has counted itself; whether a frame tells it."""
        frame = self.table.frames.get('turns_told')
        told = None if frame is None else frame.unpack(identifier, data)
        if told is None or any(told.get(who, number) != number
                               for who, number in self._ids.items()):
            return False
        if self.turns.asking:
            self.turns.whole(struct.unpack('<f', int(told['angle']).to_bytes(4, 'little'))[0])
        return True

    def foreign(self, identifier: int, data: bytes) -> str:
        """Return which of a driver's frames was heard."""
        if bool(identifier & EXTENDED) != self.table.extended:
            return ''
        for name in self.table.commands:
            if name == 'turns':  # who reads a parameter commands nothing
                continue
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
