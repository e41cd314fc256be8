"""
An ODrive axis over CAN Simple: set-points out, estimates and current back by remote frames.

The table is devices/tables/odrive_cansimple.dbc. Positions are revolutions of the motor, torques
N m at the motor. Source: ODrive documentation, CAN Protocol.
"""

from __future__ import annotations

from collections.abc import Callable
from math import tau

from ..can_bus.bus_port import BusPort, Frames
from ..can_bus.unix_frames import EXTENDED, FD, REMOTE
from ..driver.limits import Mode, Setpoint
from ..driver.rig_watch import RigWatch
from .dbc_messages import DbcMessages
from .device import Answer, DeviceError
from .doubled_ids import ECHO
from .drive_master import DriveState, Order
from .drive_settings import DriveSettings
from .on_request import NO_ANSWER, OnRequest

NODES = 32
"""Identifiers of one axis; the upper bits are its id, the lower five the command."""
AXES = 63
"""The largest id of an axis: it has six bits."""
ANSWERS = ('Get_Encoder_Estimates', 'Get_Iq')
SELDOM = 'Get_Temperature'
SELDOM_EVERY = 50  # requests
ESTOP = 'emergency stop requested'
"""The error, in the words of the table, that a button leaves."""
STARVED = 'watchdog timer expired'
"""The error, in the words of the table, of an axis that heard nothing for too long."""
BEATS_WITHIN = 1_000_000_000  # ns; ten heartbeats as delivered
NO_BEAT = 'tells its state no more: no heartbeat (heartbeat_msg_rate_ms 100 as delivered)'
ASK_STATE_EVERY = 250_000_000  # ns; more than two heartbeats, by which a state is told
SETTLED = 2
"""Heartbeats after which a state is no older than the request for it: one may be under way."""

COMMANDS = (
    ('Set_Axis_State', {'Axis_Requested_State': 'idle'}),
    ('Set_Axis_State', {'Axis_Requested_State': 'closed loop control'}),
    *(('Set_Controller_Mode', {'Control_Mode': mode, 'Input_Mode': 'passthrough'})
      for mode in ('torque', 'velocity', 'position')),
    ('Set_Input_Pos', {'Input_Pos': 0.0, 'Vel_FF': 0.0, 'Torque_FF': 0.0}),
    ('Set_Input_Vel', {'Input_Vel': 0.0, 'Input_Torque_FF': 0.0}),
    ('Set_Input_Torque', {'Input_Torque': 0.0}),
    ('Clear_Errors', {'Identify': 0}),
)
"""All that the driver says, with values that a table has to know."""

_STATES = {'idle': DriveState.SWITCH_ON_DISABLED,
           'closed loop control': DriveState.OPERATION_ENABLED}


class Odrive(OnRequest):
    """One axis, by the messages of a DBC file."""

    kinds = len(ANSWERS)

    def __init__(self, messages: DbcMessages, settings: DriveSettings, watch: RigWatch) -> None:
        super().__init__(settings, watch)
        if settings.node > AXES:
            raise DeviceError(f'device.id = {settings.node}; an ODrive axis has one up to {AXES}')
        self.messages = messages
        self._base = settings.node * NODES
        self._requests = [self._request(name) for name in ANSWERS]
        self._seldom = self._request(SELDOM)
        self._asks = 0

    def forget_told(self) -> None:
        """Forget the mode and the state that were told."""
        self._mode = ''
        self._wanted = self._goes = ''  # asked for lately, asked for last
        self._wanted_at = 0
        self._beats = 0  # since another state was asked for
        self._beat_at = self._taken_at = 0
        self._beaten = True  # whether a heartbeat came since the last request
        self._beaten_at = 0

    def _message(self, name: str, **values: float | str) -> tuple[int, bytes]:
        identifier, data = self.messages.encode(name, values)
        return self._base + identifier, data

    def _request(self, name: str) -> tuple[int, bytes]:
        return self._base + self.messages.identifier(name) | REMOTE, b''

    def query(self) -> Frames:
        """Return the remote frames that make an answer."""
        self._asks += 1
        return self._requests + ([self._seldom] if self._asks % SELDOM_EVERY == 1 else [])

    def off(self) -> Frames:
        """Return the request for the state without torque."""
        self._wanted = ''
        return self._state_asked('idle')

    def frames(self, order: Order, point: Setpoint | None, now: int) -> Frames:
        """Return what gives the order, and the request."""
        self._miss_beats(now)
        if self.up(order):
            told = self._input(order, point)
        elif order is Order.ENABLE:
            asked = self._ask_state('closed loop control', now)
            if asked:  # it may have started again, and be in the mode of its configuration
                self.unsent()
            told = self._input(order, None) + asked
        elif order is Order.RESET:
            told = [self._message('Clear_Errors', Identify=0)] if self.clears(order) else []
        elif self._state is DriveState.FAULT:
            told = []
        else:
            told = self._ask_state('idle', now)
        return told + self.query()

    def _miss_beats(self, now: int) -> None:
        """Take a state that was not told again for BEATS_WITHIN as unknown."""
        if self._beaten:
            self._beaten, self._beaten_at = False, now
        elif now - self._beaten_at > BEATS_WITHIN:
            self._state, self._fault = DriveState.UNKNOWN, NO_BEAT
            self._note_loss(f'answers, but {NO_BEAT},')

    def unsent(self) -> None:
        """Tell the mode again."""
        self._mode = ''

    def _ask_state(self, name: str, now: int) -> Frames:
        """Return the request for a state; not each time, since an axis then enters it again."""
        if self._wanted == name and now - self._wanted_at < ASK_STATE_EVERY:
            return []
        if name == 'idle' and self._state is DriveState.SWITCH_ON_DISABLED and self.settled:
            return []
        self._wanted, self._wanted_at = name, now
        return self._state_asked(name)

    def _state_asked(self, name: str) -> Frames:
        if name != self._goes:
            self._goes, self._beats = name, 0
        return [self._message('Set_Axis_State', Axis_Requested_State=name)]

    @property
    def settled(self) -> bool:
        """Whether the state was told after the last request for another one."""
        return self._beats >= SETTLED

    def _input(self, order: Order, point: Setpoint | None) -> Frames:
        """
        Return the set-point, and where its mode is another one the mode between two of it.

        An axis keeps an input for each mode. By the mode alone it would follow what that input
        was last, which may be beyond a limit by now; by a mode of position it forgets its input.
        """
        own = self.settings
        to_motor = own.ratio / tau
        if order is Order.QUICK_STOP:
            mode, sent = 'velocity', self._message('Set_Input_Vel', Input_Vel=0.0,
                                                   Input_Torque_FF=0.0)
        elif point is None or point.mode is Mode.OFF:
            mode, sent = 'torque', self._message('Set_Input_Torque', Input_Torque=0.0)
        elif point.mode is Mode.CURRENT:
            mode, sent = 'torque', self._message(
                'Set_Input_Torque', Input_Torque=point.reference * own.torque_constant)
        elif point.mode is Mode.VELOCITY:
            mode, sent = 'velocity', self._message(
                'Set_Input_Vel', Input_Vel=point.reference * to_motor, Input_Torque_FF=0.0)
        else:
            mode, sent = 'position', self._message(
                'Set_Input_Pos', Input_Pos=point.reference * to_motor, Vel_FF=0.0, Torque_FF=0.0)
        if mode == self._mode:
            return [sent]
        self._mode = mode
        return [sent, self._message('Set_Controller_Mode', Control_Mode=mode,
                                    Input_Mode='passthrough'), sent]

    def proves_down(self, port: BusPort, now: Callable[[], int], wanted: Callable[[], bool]
                    ) -> bool:
        """Ask nothing more: `settled` says that heartbeats have told its state since."""
        return True

    def take(self, identifier: int, data: bytes, now: int) -> Answer | None:
        """Take a frame; a heartbeat that comes twice at once is one."""
        self._taken_at = now
        return super().take(identifier, data, now)

    def hear(self, identifier: int, data: bytes) -> int | None:
        """Keep what a message of the axis tells; return its place in ANSWERS."""
        name = self.messages.name_of(identifier - self._base)
        if name is None or not self.messages.from_device(name):
            return None
        told = self.messages.decode(name, data)
        own, reading = self.settings, self.reading
        if name == 'Heartbeat':
            self._take_heartbeat(int(told['Axis_Error']), int(told['Axis_State']))
        elif name == 'Get_Encoder_Estimates':
            reading.motor_position = told['Pos_Estimate'] * tau
            reading.load_speed = told['Vel_Estimate'] * tau / own.ratio
        elif name == 'Get_Iq':
            reading.current = told['Iq_Measured']
            reading.current_reference = told['Iq_Setpoint']
        elif name == SELDOM:
            reading.temperature = told['Motor_Temperature']
        return ANSWERS.index(name) if name in ANSWERS else NO_ANSWER

    def _take_heartbeat(self, errors: int, state: int) -> None:
        self._beaten = True
        self._beats += self._taken_at - self._beat_at > ECHO
        self._beat_at = self._taken_at
        words = self.messages.words('Heartbeat', 'Axis_State', state)
        self._state = _STATES.get(words, DriveState.NOT_READY)
        self._fault = ', '.join(
            self.messages.words('Heartbeat', 'Axis_Error', 1 << bit)
            for bit in range(errors.bit_length()) if errors >> bit & 1)
        self.emergency_stop = ESTOP in self._fault
        self.missed = self._fault == STARVED
        if errors and self._state is DriveState.SWITCH_ON_DISABLED:
            self._state = DriveState.FAULT

    def foreign(self, identifier: int, data: bytes) -> str:
        """Return which request or command of another driver was heard; anybody may press Estop."""
        if identifier & (EXTENDED | FD):
            return ''
        name = self.messages.name_of((identifier & ~REMOTE) - self._base)
        if name is None or name == 'Estop':
            return ''
        return f'{name} (0x{identifier & ~REMOTE:03X})'

    def stops(self, identifier: int, data: bytes) -> bool | None:
        """Whether a state is asked for that gives no torque, or one that does."""
        if self.messages.name_of(identifier - self._base) != 'Set_Axis_State':
            return None
        wanted = self.messages.encode('Set_Axis_State', {
            'Axis_Requested_State': 'closed loop control'})[1]
        return data != wanted


def load_odrive(name: str) -> DbcMessages:
    """Return the messages of a shipped DBC file or of another one; raises DeviceError."""
    messages = DbcMessages(name)
    messages.need('Heartbeat', 'Axis_Error', 'Axis_State')
    messages.need('Get_Encoder_Estimates', 'Pos_Estimate', 'Vel_Estimate')
    messages.need('Get_Iq', 'Iq_Setpoint', 'Iq_Measured')
    messages.need(SELDOM, 'Motor_Temperature')
    for command, values in COMMANDS:  # so that none fails beside a motor
        messages.need(command, *values)
        messages.encode(command, values)
    return messages
