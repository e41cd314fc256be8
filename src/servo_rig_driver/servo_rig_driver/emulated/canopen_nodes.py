"""
The emulated rig's three CANopen nodes: frames in, frames out, around a Bench.

PDOs are packed by the frame table, SDOs answered by canopen's LocalNode. Time is handed in, s.
"""

from __future__ import annotations

from collections.abc import Callable
import logging
from struct import Struct

from ..devices.object_dictionary import DriveMode
from ..devices.pdo_table import Field, Frame, FrameError, FrameTable, HEARTBEAT_ID, NMT_ID, SYNC_ID
from . import rig_sampling as sampling
from .drive_states import DriveStates, QUICK_STOP
from .emulated_bench import Bench
from .object_server import HEARTBEAT_TIME, Objects, Send, WATCHDOG

BOOT_UP, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0x00, 0x04, 0x05, 0x7F
PACE = 1000  # SYNCs after which their rate is judged
SYNC_LOST = 0.1  # s after which an enabled drive without SYNC fails, unless it is told another
AT_REST = 0.05  # rad/s at the motor, where a quick stop ends
EMERGENCY_ID, SDO_ANSWER_ID = 0x80, 0x580
LENGTH_ERROR, NO_RPDO, NO_SYNC = 0x8210, 0x8250, 0x8700

_NMT = {1: OPERATIONAL, 2: STOPPED, 0x80: PRE_OPERATIONAL, 0x81: BOOT_UP, 0x82: BOOT_UP}
_EMERGENCY = Struct('<HB5x')
_MODES = {DriveMode.VOLTAGE: sampling.VOLTAGE_MODE, DriveMode.CURRENT: sampling.CURRENT_MODE,
          DriveMode.TORQUE: sampling.CURRENT_MODE, DriveMode.VELOCITY: sampling.VELOCITY_MODE,
          DriveMode.POSITION: sampling.POSITION_MODE}
_TARGETS = {DriveMode.VOLTAGE: 'command_voltage', DriveMode.CURRENT: 'target_current',
            DriveMode.VELOCITY: 'target_velocity', DriveMode.POSITION: 'target_position'}

_WRITTEN_TARGETS = {0x2000: 'command_voltage', 0x2002: 'target_current',
                    0x60FF: 'target_velocity', 0x607A: 'target_position'}

log = logging.getLogger('emulated_rig')


class RigNodes:
    """
    Drive, load encoder and torque sensor of one emulated rig.

    ``send`` takes a list of frames; ``watchdog``, s, is after what silence the drive fails.
    ``refused`` counts frames of the wrong length, ``syncs`` the SYNCs answered.
    """

    fd = False
    slowest_beat = 8.0  # s; drivers ask for a quarter of 30 s at the most

    def __init__(self, bench: Bench, frames: FrameTable, send: Send,
                 watchdog: float = SYNC_LOST) -> None:
        self.bench = bench
        self.frames = frames
        self.drive = DriveStates()
        self.refused = 0
        self.syncs = 0
        self._send = send
        self._watchdog = watchdog
        self._states = dict.fromkeys(frames.ids, PRE_OPERATIONAL)
        self._next_beat = dict.fromkeys(frames.ids, 0.0)
        self._objects = Objects(frames, send, self._read, self._written)
        self._received = {frame.cob_id: (frame, self._taker(frame))
                          for frame in frames.values() if not frame.transmitted}
        self._tpdos = {name: [frame for frame in frames.values() if frame.transmitted
                              and frame.name.startswith(name + '.')] for name in frames.ids}
        self.mode = DriveMode.NONE
        self._targets: dict[str, float] = {}
        self._pending: dict[str, float] = {}
        self._external = self._pending_external = 0.0
        self._silent = self._silent_load = 0
        self._last_sync: float | None = None
        self._paced_since = 0.0
        self._warned = False
        self._values: dict[str, dict[str, float]] = {name: {} for name in frames.ids}
        self._own = {
            **{kind + number: name for name, number in frames.ids.items()
               for kind in (HEARTBEAT_ID, EMERGENCY_ID, SDO_ANSWER_ID)},
            **{frame.cob_id: name for name, sent in self._tpdos.items() for frame in sent}}

    @property
    def gives_torque(self) -> bool:
        """Whether the motor has current."""
        return self.drive.gives_torque

    def own(self, identifier: int, data: bytes) -> str:
        """Return which node alone sends such a frame; '' for one of others."""
        return self._own.get(identifier, '')

    def boot(self) -> None:
        """Announce all nodes on the bus."""
        self._send([(HEARTBEAT_ID + number, bytes([BOOT_UP]))
                    for number in self.frames.ids.values()])

    def take(self, identifier: int, data: bytes, now: float) -> None:
        """Answer one frame; what concerns no node of the rig is ignored."""
        if identifier == SYNC_ID:
            self._sync(data, now)
        elif identifier in self._received:
            frame, take = self._received[identifier]
            try:
                take(frame.unpack(data))
            except FrameError as error:
                self.refused += 1
                log.error('refused: %s', error)
                self._emergency(LENGTH_ERROR)
        elif identifier == NMT_ID:
            self._manage(data)
        else:
            self._objects.take(identifier, data, now)

    def tick(self, now: float) -> None:
        """Send the heartbeats that are due and see whether SYNC has stopped."""
        for name, number in self.frames.ids.items():
            every = self._objects.setting(name, HEARTBEAT_TIME)
            if every and now >= self._next_beat[name]:
                self._next_beat[name] = now + every
                self._send([(HEARTBEAT_ID + number, bytes([self._states[name]]))])
        if self._last_sync is not None and now - self._last_sync > self._watchdog:
            if self.drive.gives_torque:
                self._fail(NO_SYNC)
            self.bench.answer(sampling.OFF, 0.0, 0.0)
            self.bench.advance(min(now - self._last_sync, 1.0))
            self._last_sync = now

    def _sync(self, data: bytes, now: float) -> None:
        if len(data) > 1:
            self.refused += 1
            log.error('refused: SYNC has %d bytes, expected 0 or 1', len(data))
            return
        self._last_sync = now
        self.syncs += 1
        self._pace(now)
        self._watch()
        self._targets.update(self._pending)
        self._pending.clear()
        self._external = self._pending_external
        mode, reference = self._set_point()
        out = self.bench.answer(mode, reference, self._external)
        if self.drive.state is QUICK_STOP and abs(out[sampling.SPEED]) < AT_REST:
            self.drive.stopped()
        counter = data[0] if data else 0
        self._keep(out, counter)
        answers = []
        for name, frames in self._tpdos.items():
            if self._states[name] == OPERATIONAL:
                values = self._values[name]
                answers += [(frame.cob_id, frame.pack([values[key] for key in frame.names], True))
                            for frame in frames if self.syncs % frame.transmission_type == 0]
        if answers:
            self._send(answers)
        self.bench.advance()

    def _pace(self, now: float) -> None:
        if self.syncs % PACE == 1:
            measured = (now - self._paced_since) / PACE
            told = self.bench.period
            if self.syncs > PACE and not 0.8 < measured / told < 1.25 and not self._warned:
                self._warned = True
                log.warning('SYNC comes every %.3g ms but object 1006h says %.3g ms: the '
                            'rig lives by the latter', 1e3 * measured, 1e3 * told)
            self._paced_since = now

    def _keep(self, out: list[float], counter: int) -> None:
        self._values['drive'].update(
            position_actual_value=out[sampling.MOTOR], velocity_actual_value=out[sampling.SPEED],
            statusword=self.drive.statusword, motor_current=out[sampling.CURRENT],
            modes_of_operation_display=self.mode, sample_counter=counter,
            applied_voltage=out[sampling.VOLTAGE],
            current_reference=out[sampling.CURRENT_REFERENCE])
        self._values['load_encoder'].update(position_value=out[sampling.LOAD],
                                            sample_counter=counter)
        self._values['torque_sensor'].update(
            transmitted_torque=out[sampling.TORQUE], external_torque=out[sampling.EXTERNAL_NOW],
            gearbox_temperature=out[sampling.TEMPERATURE], sample_counter=counter)

    def _set_point(self) -> tuple[float, float]:
        if self.drive.state is QUICK_STOP:
            return sampling.VELOCITY_MODE, 0.0
        if not self.drive.enabled or self.mode not in _MODES:
            return sampling.OFF, 0.0
        if self.mode is DriveMode.TORQUE:
            torque = (self._objects.stored('drive', 0x6071)
                      * self._objects.stored('drive', 0x6076))
            return _MODES[self.mode], torque / self.bench.rig.values['machine.torque_constant']
        target = self._targets.get(_TARGETS[self.mode])
        if target is None:  # none since the mode began: hold still
            if self.mode is not DriveMode.POSITION:
                return _MODES[self.mode], 0.0
            angle = float(self.bench.out[sampling.MOTOR])
            target = self._targets['target_position'] = (
                angle / self.bench.rig.values['machine.ratio'])
        return _MODES[self.mode], target

    def _watch(self) -> None:
        self._silent += 1
        most = self._objects.setting('drive', WATCHDOG)
        if most and self._silent > most and self.drive.enabled:
            self._fail(NO_RPDO)
        self._silent_load += 1
        most = self._objects.setting('torque_sensor', WATCHDOG)
        if most and self._silent_load > most:
            self._pending_external = 0.0

    def _taker(self, frame: Frame) -> Callable[[list[float]], None]:
        if frame.name == 'drive.rpdo1':
            return lambda values: self._control(int(values[0]), int(values[1]))
        if frame.name.startswith('drive.'):
            return lambda values: self._target(frame.names, values)
        return self._load

    def _control(self, word: int, mode: int) -> None:
        if self._states['drive'] != OPERATIONAL:
            return
        self._silent = 0
        self.set_mode(mode)
        failed = self.drive.error
        self.drive.command(word)
        if failed and not self.drive.error:
            self._emergency(0)
        if not self.drive.enabled:
            self._targets.clear()

    def _target(self, names: tuple[str, ...], values: list[float]) -> None:
        if self._states['drive'] == OPERATIONAL:
            self._silent = 0
            self._pending.update(zip(names, values, strict=True))

    def _load(self, values: list[float]) -> None:
        if self._states['torque_sensor'] == OPERATIONAL:
            self._silent_load = 0
            self._pending_external = values[0]

    def set_mode(self, mode: int) -> None:
        """Change the mode of operation; a mode that the drive does not have is ignored."""
        if mode == self.mode or mode not in DriveMode._value2member_map_:
            return
        if mode in (DriveMode.CURRENT, DriveMode.TORQUE) \
                and not self.bench.rig.values['drive.current_loop']:
            return
        self.mode = DriveMode(mode)
        self._targets.clear()
        self._pending.clear()

    def _fail(self, error: int) -> None:
        self.drive.fail(error)
        self._targets.clear()
        self._emergency(error)
        log.warning('the drive failed with error %04Xh', error)

    def _emergency(self, error: int) -> None:
        self._send([(EMERGENCY_ID + self.frames.ids['drive'],
                     _EMERGENCY.pack(error, int(self.drive.error != 0)))])

    def _manage(self, data: bytes) -> None:
        if len(data) != 2 or data[0] not in _NMT:
            self.refused += 1
            log.error('refused: NMT %s', data.hex(' ') or 'without data')
            return
        for name, number in self.frames.ids.items():
            if data[1] not in (0, number):
                continue
            state = _NMT[data[0]]
            if state == BOOT_UP:
                self._send([(HEARTBEAT_ID + number, bytes([BOOT_UP]))])
                state = PRE_OPERATIONAL
                if name == 'drive':
                    self.drive = DriveStates()
                    self.mode = DriveMode.NONE
            if name == 'drive' and state != OPERATIONAL:
                self.drive.switch_off()
            if name == 'torque_sensor' and state != OPERATIONAL:
                self._pending_external = 0.0
            self._states[name] = state

    def _read(self, node: str, index: int, field: Field | None) -> int | None:
        if node == 'drive' and index in (0x603F, 0x1001, 0x6041, 0x6061):
            return {0x603F: self.drive.error, 0x1001: int(self.drive.error != 0),
                    0x6041: self.drive.statusword, 0x6061: int(self.mode)}[index]
        value = self._values[node].get(field.name) if field else None
        return None if value is None else field.to_integer(value)

    def _written(self, node: str, index: int, raw: int, value: float) -> None:
        if node == 'torque_sensor' and index == 0x9300:
            self._pending_external = value
        if node != 'drive':
            return
        if index == 0x1006 and raw > 0:
            self.bench.period = value
        elif index == 0x2011 and raw:
            self._fail(raw)
        elif index == 0x6060:
            self.set_mode(raw)
        elif index == 0x6040:
            self._control(raw, self.mode)
        elif index in _WRITTEN_TARGETS:
            self._pending[_WRITTEN_TARGETS[index]] = value
