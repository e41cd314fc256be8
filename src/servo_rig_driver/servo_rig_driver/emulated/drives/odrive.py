"""An emulated ODrive axis: CAN Simple around the machine, a heartbeat each 100 ms."""

from __future__ import annotations

from math import tau

from ...can_bus.unix_frames import REMOTE
from ...devices.dbc_messages import DbcMessages
from ...devices.drive_settings import DriveSettings
from ...devices.pdo_table import FrameError
from .. import rig_sampling
from ..emulated_bench import Bench
from .one_drive import OneDrive, Send

LOOP_RATE = 8000.0  # Hz; ODrive's control loop
HEARTBEAT = 0.1  # s; heartbeat_msg_rate_ms as delivered
IDLE, CLOSED_LOOP = 1, 8
TORQUE, VELOCITY, POSITION = 1, 2, 3
WATCHDOG_EXPIRED, ESTOP = 0x01000000, 0x02000000
SUPPLY = 24.0  # V


class EmulatedOdrive(OneDrive):
    """One axis; its error register holds what it was disarmed for. It uses no feed-forward."""

    def __init__(self, bench: Bench, messages: DbcMessages, settings: DriveSettings, send: Send
                 ) -> None:
        super().__init__(bench, settings, LOOP_RATE, send)
        self.messages = messages
        self._base = settings.node * 32
        self.power_on()
        self._heartbeat = self._base + messages.identifier('Heartbeat')

    def power_on(self) -> None:
        """Stand idle, in the mode of a drive as delivered."""
        self.state = IDLE
        self.errors = 0
        self._mode = VELOCITY
        self._inputs = dict.fromkeys((TORQUE, VELOCITY, POSITION), 0.0)
        self._next_beat = 0.0

    @property
    def gives_torque(self) -> bool:
        """Whether the axis is in closed loop control."""
        return self.state == CLOSED_LOOP

    def command(self) -> tuple[float, ...]:
        """Return the input by the controller's mode, at the load."""
        values = self.bench.rig.values
        if self.state != CLOSED_LOOP:
            return (rig_sampling.OFF,)
        given = self._inputs[self._mode]
        if self._mode == TORQUE:
            return rig_sampling.CURRENT_MODE, given / values['machine.torque_constant']
        at_load = given * tau / values['machine.ratio']
        mode = rig_sampling.VELOCITY_MODE if self._mode == VELOCITY else rig_sampling.POSITION_MODE
        return mode, at_load

    def hear(self, identifier: int, data: bytes, now: float) -> bool:
        """Take a message; any to the axis feeds its watchdog."""
        name = self.messages.name_of((identifier & ~REMOTE) - self._base)
        if name is None:
            return False
        if identifier & REMOTE:
            self._reply(name)
            return True
        try:
            told = self.messages.decode(name, data)
        except FrameError:
            self.refused += 1
            return False
        self._obey(name, told)
        return True

    def _obey(self, name: str, told: dict[str, float]) -> None:
        if name == 'Estop':
            self.fail(ESTOP)
        elif name == 'Clear_Errors':
            self.errors = 0
        elif name == 'Set_Axis_State':
            wanted = int(told['Axis_Requested_State'])
            if wanted == IDLE or (wanted == CLOSED_LOOP and not self.errors):
                self.state = wanted
        elif name == 'Set_Controller_Mode':
            self._mode = int(told['Control_Mode'])
            if self._mode == POSITION:
                self._inputs[POSITION] = self.last[rig_sampling.MOTOR] / tau
        elif name in _INPUTS:
            self._inputs |= {mode: told[said] for mode, said in _INPUTS[name].items()}

    def _reply(self, name: str) -> None:
        if name == 'Get_Encoder_Estimates':
            self.step()
        values = self._told(name)
        if values is not None:
            identifier, data = self.messages.encode(name, values)
            self.send([(self._base + identifier, data)])

    def _told(self, name: str) -> dict[str, float] | None:
        out, values = self.last, self.bench.rig.values
        kt = values['machine.torque_constant']
        wanted = out[rig_sampling.CURRENT_REFERENCE]
        return {
            'Get_Encoder_Estimates': {'Pos_Estimate': out[rig_sampling.MOTOR] / tau,
                                      'Vel_Estimate': out[rig_sampling.SPEED] / tau},
            'Get_Iq': {'Iq_Setpoint': wanted, 'Iq_Measured': out[rig_sampling.CURRENT]},
            'Get_Torques': {'Torque_Target': wanted * kt,
                            'Torque_Estimate': out[rig_sampling.CURRENT] * kt},
            'Get_Temperature': {'FET_Temperature': out[rig_sampling.TEMPERATURE],
                                'Motor_Temperature': out[rig_sampling.TEMPERATURE]},
            'Get_Bus_Voltage_Current': {'Bus_Voltage': SUPPLY, 'Bus_Current': 0.0},
            'Get_Error': {'Active_Errors': 0, 'Disarm_Reason': self.errors},
        }.get(name)

    def own(self, identifier: int, data: bytes) -> str:
        """Return that an axis sends a heartbeat of this id."""
        return 'axis' if identifier == self._heartbeat else ''

    def beat(self, now: float) -> None:
        """Send the heartbeat when it is due."""
        if now < self._next_beat:
            return
        self._next_beat = now + HEARTBEAT
        identifier, data = self.messages.encode('Heartbeat', {
            'Axis_Error': self.errors, 'Axis_State': self.state, 'Procedure_Result': 0,
            'Trajectory_Done_Flag': 0})
        self.send([(self._base + identifier, data)])

    def starved(self) -> None:
        """Disarm for want of messages."""
        self.fail(WATCHDOG_EXPIRED)

    def fail(self, code: int) -> None:
        """Disarm with an error, and tell so at once."""
        self.errors |= code
        self.state = IDLE
        self._next_beat = 0.0


_INPUTS = {'Set_Input_Pos': {POSITION: 'Input_Pos', VELOCITY: 'Vel_FF', TORQUE: 'Torque_FF'},
           'Set_Input_Vel': {VELOCITY: 'Input_Vel', TORQUE: 'Input_Torque_FF'},
           'Set_Input_Torque': {TORQUE: 'Input_Torque'}}
"""
What a message sets, by the mode that follows it; a feed-forward is the input of a lower mode. An
axis keeps all three through a change of mode.
"""
