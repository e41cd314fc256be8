"""
Stands between the rig's hub and the driver's: passes frames on, spoils them, and keeps a log.

    python wire_proxy.py RIG_SOCKET DRIVER_SOCKET LOG ANSWERS

Each line on stdin names what happens to the frames from now on, as JSON: ``{"mode": "drop",
"share": 0.05}``. The log holds what the driver told the drive, before anything was spoilt here,
and what the drive answered at the rig. It is the witness of what a driver did, whatever the driver
says of itself. Two nodes that only listen keep it, one on either bus: no entry waits here.
ANSWERS holds what the load encoder told the driver, and the count of the SYNC that it answered.
"""

from __future__ import annotations

import json
from math import isnan, nan
from random import Random
from signal import SIG_IGN, SIGINT, signal
from struct import Struct
import sys
from threading import Thread
from time import sleep, time

import can

from servo_rig_driver.can_bus.bus_opening import BusSettings, open_bus, Wire
from servo_rig_driver.devices.pdo_table import load_frames, SYNC_COUNTS, SYNC_ID

RECORD = Struct('<ddBf')  # s: not before, seen at; kind; value
ANSWER = Struct('<dBf')  # s: seen at; count of its SYNC; load angle, rad
CONTROL, MODE, VELOCITY, VOLTAGE, STATUS, SYNC = range(6)
TURN = 2.0 * 3.141592653589793


class WireProxy:
    """Passes frames between two buses; ``mode`` says how badly."""

    def __init__(self, rig: str, driver: str, log: str, answers: str) -> None:
        self.names = {'rig': rig, 'driver': driver}
        self.wires: dict[str, Wire] = {}
        self.mode: dict = {'mode': 'clean'}
        self.random = Random(7)
        self.held: dict[str, list] = {'rig': [], 'driver': []}
        self.stuck: bytes | None = None
        self.log = open(log, 'ab', buffering=0)
        self.answers = open(answers, 'ab', buffering=0)
        self.table = load_frames('rv_bench')
        self.encoder = self.table['load_encoder.tpdo1']
        self.last: dict[int, float] = {}

    def run(self) -> None:
        """Pass frames until stdin ends."""
        for side in self.names:
            Thread(target=self._pass, args=(side,), daemon=True).start()
            Thread(target=self._watch, args=(side,), daemon=True).start()
        for line in sys.stdin:
            self.mode = json.loads(line)
            self.stuck = None

    def _watch(self, side: str) -> None:
        wire, empty = None, time()
        while True:
            try:
                wire = wire or Wire(open_bus(BusSettings('unix_bus', self.names[side]), 1.0))
                before = time()  # the machine may stand still between two lines
                frames = wire.recv(0.0)
                if not frames:  # nothing waited: what comes now was sent after that instant
                    empty = before
                    frames = wire.recv(0.2)
                self._note(side, frames, empty)
            except (can.CanError, OSError):
                wire = None
                sleep(0.02)

    def _wire(self, side: str) -> Wire:
        if side not in self.wires:
            self.wires[side] = Wire(open_bus(BusSettings('unix_bus', self.names[side]), 0.0))
        return self.wires[side]

    def _pass(self, side: str) -> None:
        other = 'driver' if side == 'rig' else 'rig'
        while True:
            try:
                frames = self._wire(side).recv(0.2)
            except (can.CanError, OSError):
                self.wires.pop(side, None)
                sleep(0.05)
                continue
            frames = self._spoilt(side, frames)
            try:
                if frames:
                    self._wire(other).send(frames)
            except (can.CanError, OSError):
                self.wires.pop(other, None)

    def _note(self, side: str, frames: list[tuple[int, bytes]], empty: float) -> None:
        now, out, answered = time(), b'', b''
        for identifier, data in frames:
            frame = self.table.by_id.get(identifier)
            if side == 'driver' and frame is self.encoder and len(data) == frame.length:
                position, count = frame.unpack(data)
                if 1 <= count <= SYNC_COUNTS and not isnan(position):
                    answered += ANSWER.pack(now, int(count), position)
            if side == 'rig' and identifier == SYNC_ID:
                out += RECORD.pack(empty, now, SYNC, 0.0)
            if frame is None or len(data) != frame.length or (side == 'rig') != (
                    frame.transmitted):
                continue
            told = frame.decode(data)
            for name, kind in (('controlword', CONTROL), ('modes_of_operation', MODE),
                               ('target_velocity', VELOCITY), ('command_voltage', VOLTAGE),
                               ('statusword', STATUS)):
                if name in told and (kind in (VELOCITY, VOLTAGE)
                                     or self.last.get(kind) != told[name]):
                    self.last[kind] = told[name]
                    out += RECORD.pack(empty, now, kind, told[name])
        for log, entries in ((self.log, out), (self.answers, answered)):
            if entries:
                log.write(entries)

    def _spoilt(self, side, frames):
        said = self.mode
        kind, share = said['mode'], said.get('share', 0.05)
        if kind == 'clean':
            return frames
        hit = self.random.random
        if kind == 'silent':
            return []
        if kind == 'drop':
            return [one for one in frames if hit() >= share]
        if kind == 'double':
            return [one for one in frames for _ in range(1 + (hit() < share))]
        if kind == 'delay':
            sleep(said.get('seconds', 0.005) * hit())
            return frames
        if kind == 'jitter' and side == 'driver' and any(i == SYNC_ID for i, _ in frames):
            sleep(said.get('seconds', 0.003) * hit())
            return frames
        if kind == 'reorder':
            late, self.held[side] = self.held[side], [one for one in frames if hit() < share]
            return [one for one in frames if one not in self.held[side]] + late
        if kind == 'short':
            return [(i, d[:-1] if hit() < share else d) for i, d in frames]
        if kind == 'flip':
            return [(i, self._flipped(d) if d and hit() < share else d) for i, d in frames]
        if kind == 'noise':
            made = (self.random.randrange(0x800), self.random.randbytes(self.random.randrange(9)))
            told = self.table.by_id.get(made[0])
            if side == 'rig' and told and not told.transmitted:
                return frames  # the witness would take it for what the driver told the drive
            return [*frames, made]
        if kind in ('stuck', 'nan', 'turn') and side == 'rig':
            return [(i, self._sensed(kind, d) if i == self.encoder.cob_id else d)
                    for i, d in frames]
        return frames

    def _flipped(self, data: bytes) -> bytes:
        made = bytearray(data)
        made[self.random.randrange(len(made))] ^= 1 << self.random.randrange(8)
        return bytes(made)

    def _sensed(self, kind: str, data: bytes) -> bytes:
        told = self.encoder.decode(data)
        if kind == 'stuck':
            self.stuck = told['position_value'] if self.stuck is None else self.stuck
            told['position_value'] = self.stuck
        elif kind == 'nan':
            told['position_value'] = nan
        else:
            told['position_value'] += TURN
        return self.encoder.encode(told)


if __name__ == '__main__':
    signal(SIGINT, SIG_IGN)  # it ends with its stdin
    WireProxy(*sys.argv[1:5]).run()
