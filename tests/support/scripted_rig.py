"""
A rig that does what a test tells it: three nodes on a bus, no physics.

Sample number n (the n-th SYNC since NMT start) reads n thousandths in every channel, so that a
test sees whether a sample was joined from answers to one SYNC.
"""

from __future__ import annotations

from math import nan
from threading import Event, Thread
from time import monotonic

from can import CanError

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire
from servo_rig_driver.devices.pdo_table import HEARTBEAT_ID, load_frames, NMT_ID, SYNC_ID

DISABLED, READY, ON, ENABLED, FAULT, QUICK_STOP = 0x0250, 0x0231, 0x0233, 0x0237, 0x0218, 0x0217
NODES = {1: 'drive', 2: 'load_encoder', 3: 'torque_sensor'}


class ScriptedRig:
    """
    Answers SYNC until close().

    ``taken`` keeps what the drive was told: (mode, target of that mode, controlword) at each SYNC.
    ``silent`` holds nodes that say nothing, ``stubborn`` refuses fault resets, ``written`` keeps
    what was written by SDO, by node and index. ``leap``, rad, is what the motor's angle is off.
    """

    def __init__(self, channel: str, interface: str = 'unix_bus') -> None:
        self.table = load_frames()
        self.wire = Wire(open_bus(BusSettings(interface, channel)))
        self.taken: list[tuple[int, float, int]] = []
        self.external: list[float] = []
        self.written: dict[tuple[int, int], int] = {}
        self.silent: set[int] = set()
        self.stubborn = False
        self.leap = 0.0
        self.status = DISABLED
        self.count = 0
        self._running = False
        self._control = 0
        self._mode = 0
        self._targets: dict[str, float] = {}
        self._stop = Event()
        self._thread = Thread(target=self._serve, daemon=True)
        self._beaten = 0.0
        self._send_states(0x00)
        self._thread.start()

    def fail(self, code: int) -> None:
        """Go into fault with an emergency."""
        self.status = FAULT
        self.send([(0x81, code.to_bytes(2, 'little') + b'\x01' + bytes(5))])

    def send(self, frames: list[tuple[int, bytes]]) -> None:
        """Send any frames at all."""
        self.wire.send(frames)

    def close(self) -> None:
        """Leave the bus."""
        self._stop.set()
        self._thread.join(5.0)
        self.wire.bus.shutdown()

    def __enter__(self) -> ScriptedRig:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _serve(self) -> None:
        while not self._stop.is_set():
            try:
                for identifier, data in self.wire.recv(0.02):
                    self._take(identifier, data)
                if monotonic() - self._beaten > 0.1:
                    self._send_states(0x05 if self._running else 0x7F)
            except CanError:
                return

    def _send_states(self, state: int) -> None:
        self._beaten = monotonic()
        frames = [(HEARTBEAT_ID + n, bytes([state])) for n in NODES if n not in self.silent]
        if frames:
            self.send(frames)

    def _take(self, identifier: int, data: bytes) -> None:
        if identifier == NMT_ID:
            self._running = data[0] == 0x01
        elif identifier - 0x600 in NODES:
            node = identifier - 0x600
            self.written[node, int.from_bytes(data[1:3], 'little')] = int.from_bytes(
                data[4:8], 'little')
            if node not in self.silent:
                self.send([(0x580 + node, b'\x60' + data[1:4] + bytes(4))])
        elif identifier == SYNC_ID and self._running:
            self._answer(data[0])
        elif identifier in self.table.by_id:
            frame = self.table.by_id[identifier]
            values = frame.decode(data)
            if frame.name == 'drive.rpdo1':
                self._steer(int(values['controlword']))
                self._mode = int(values['modes_of_operation'])
            self._targets.update(values)

    def _steer(self, control: int) -> None:
        if self.status == FAULT:
            if control & 0x80 and not self._control & 0x80 and not self.stubborn:
                self.status = DISABLED
                self.send([(0x81, bytes(8))])
        elif control & 0x02 == 0:
            self.status = DISABLED
        else:
            self.status = {(DISABLED, 0x06): READY, (READY, 0x07): ON, (ON, 0x0F): ENABLED,
                           (ENABLED, 0x02): QUICK_STOP}.get(
                (self.status, control & 0x0F), self.status)
        self._control = control

    def _answer(self, counter: int) -> None:
        at = self.count * 1e-3
        self.count += 1
        name = {-1: 'command_voltage', -2: 'target_current', 9: 'target_velocity',
                8: 'target_position'}.get(self._mode)
        target = self._targets.get(name, 0.0) if self.status == ENABLED else 0.0
        self.taken.append((self._mode, target, self._control))
        self.external.append(self._targets.get('target_external_torque', 0.0))
        answers = {
            'drive.tpdo1': [at + self.leap, 0.0],
            'drive.tpdo2': [self.status, at, self._mode, counter],
            'drive.tpdo3': [target if self._mode == -1 else 0.0, nan],
            'load_encoder.tpdo1': [at, counter],
            'torque_sensor.tpdo1': [at, self.external[-1], counter],
        }
        silent = {NODES[n] for n in self.silent}
        frames = [(self.table[key].cob_id, self.table[key].pack(values))
                  for key, values in answers.items() if key.split('.')[0] not in silent]
        if self.status == QUICK_STOP:  # nothing moves: it stops at once
            self.status = DISABLED
        if self.count % 10 == 1:
            frames.append((self.table['torque_sensor.tpdo2'].cob_id,
                           self.table['torque_sensor.tpdo2'].pack([25.0])))
        if frames:
            self.send(frames)
