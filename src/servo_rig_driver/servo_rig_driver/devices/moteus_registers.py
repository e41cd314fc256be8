"""
moteus registers in CAN FD frames: subframes that write, read and reply.

Bytes in, named values out, no I/O; registers, quantities and types stand in devices/tables.
Source: mjbots moteus, docs/protocol/can.md ("Subframes").
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import inf, isnan, nan
from struct import Struct

from ..can_bus.unix_frames import EXTENDED, FD, FD_SIZES, STANDARD_MASK
from .device import DeviceError
from .drive_master import DriveState
from .pdo_table import FrameError
from .tables import MALFORMED, read_table

WRITE, READ, REPLY, WRITE_ERROR, READ_ERROR, NOP = 0x00, 0x10, 0x20, 0x30, 0x31, 0x50
REPLY_WANTED = 0x8000
FAULTED, TIMEOUT = 1, 11
"""Values of the register `mode`."""
TYPES = ('int8', 'int16', 'int32', 'float')
"""In the order of their place in a subframe's first byte: base + 4 times the place + number."""
WRITTEN = ('mode', 'command_position', 'command_velocity', 'feedforward_torque', 'kp_scale',
           'kd_scale', 'watchdog_timeout', 'ilimit_scale')
TOLD = ('mode', 'fault', 'position', 'velocity', 'q_current', 'control_torque', 'temperature')
MODES = ('stopped', 'position', 'zero_velocity')
_STRUCTS = tuple(Struct(f'<{code}') for code in 'bhif')
_LOWEST = tuple(-(1 << 8 * one.size - 1) for one in _STRUCTS)


@dataclass(frozen=True)
class Register:
    """
    One register: its number, and the place in TYPES of the type under which this driver has it.

    ``scales`` is one count in the register's unit, by the places of TYPES; that of a float is 1.
    """

    name: str
    number: int
    type: int
    scales: tuple[float, ...]

    @property
    def top(self) -> float:
        """The value at which it is held under its type, of either sign; infinite for a float."""
        return inf if TYPES[self.type] == 'float' else (
            (-_LOWEST[self.type] - 1) * self.scales[self.type])

    def to_bytes(self, value: float) -> bytes:
        """Return a value on the wire: counts held at the ends, the lowest one for NaN; a float."""
        if TYPES[self.type] == 'float':
            return _STRUCTS[self.type].pack(value)
        low = _LOWEST[self.type]
        if isnan(value):
            return _STRUCTS[self.type].pack(low)
        counts = round(value / self.scales[self.type])
        return _STRUCTS[self.type].pack(min(max(counts, low + 1), -low - 1))

    def to_value(self, raw: float, place: int) -> float:
        """Return the value of what came under a type; the lowest count of an integer is NaN."""
        if TYPES[place] != 'float' and raw == _LOWEST[place]:
            return nan
        return raw * self.scales[place]


class MoteusTable:
    """The registers of a table by name and by number, and its modes, states and faults."""

    def __init__(self, name: str) -> None:
        content = read_table(name, '.yaml')
        try:
            scales = content['scales']
            self.registers = {key: Register(
                key, int(number), TYPES.index(kind),
                (*(float(scales[quantity][one]) for one in TYPES[:3]), 1.0))
                for key, (number, quantity, kind) in content['registers'].items()}
            self.by_number = {one.number: one for one in self.registers.values()}
            self.reads = [self.registers[key] for key in content['reads']]
            self.modes = {str(key): int(value) for key, value in content['modes'].items()}
            self.states = {int(key): str(value) for key, value in content['states'].items()}
            self.faults = {int(key): str(value) for key, value in content['faults'].items()}
            self.timeout = str(content['timeout'])
            missing = [key for key in WRITTEN if key not in self.registers] + [
                key for key in TOLD if self.registers.get(key) not in self.reads] + [
                key for key in MODES if key not in self.modes]
            if missing:
                raise DeviceError(f'{name}: it has no {missing}; the driver writes '
                                  f'{list(WRITTEN)}, reads {list(TOLD)}, by modes {list(MODES)}')
            for word in self.states.values():
                DriveState[word.upper()]
            for one in self.registers.values():  # so that none fails beside a motor
                one.to_bytes(0.0)
                varuint(one.number)
        except (*MALFORMED, ArithmeticError) as error:
            if isinstance(error, DeviceError):
                raise
            raise DeviceError(f'{name} is no table of moteus registers: {error!r}') from error

    def write(self, values: Mapping[str, float]) -> bytes:
        """Return subframes that write registers, in the order given."""
        return b''.join(self._subframes(WRITE, [self.registers[key] for key in values], values))

    def reply(self, values: Mapping[str, float]) -> bytes:
        """Return subframes that a device replies with."""
        return b''.join(self._subframes(REPLY, [self.registers[key] for key in values], values))

    def read(self, registers: Sequence[Register]) -> bytes:
        """Return subframes that read registers."""
        return b''.join(self._subframes(READ, registers, None))

    @staticmethod
    def _subframes(base: int, registers: Sequence[Register], values: Mapping[str, float] | None
                   ) -> Iterator[bytes]:
        """Yield a subframe for each run of registers that follow each other in one type."""
        numbered = list(enumerate(registers))
        for _, run in groupby(numbered, lambda one: (one[1].number - one[0], one[1].type)):
            alike = [register for _, register in run]
            first = base + 4 * alike[0].type
            count = len(alike)
            head = bytes([first + count] if count <= 3 else [first, count])
            head += varuint(alike[0].number)
            yield head if values is None else head + b''.join(
                one.to_bytes(values[one.name]) for one in alike)

    def parse(self, data: bytes) -> tuple[dict[str, float], list[Register]]:
        """
        Return (values written or replied by name, registers asked for) of a frame.

        Registers that the table does not have are skipped. Raises FrameError for a frame that ends
        within a subframe, an unknown subframe, or an error that the device replies.
        """
        values: dict[str, float] = {}
        asked: list[Register] = []
        at = 0
        while at < len(data):
            kind = data[at]
            at += 1
            if kind == NOP:
                continue
            base, place, count = kind & 0x30, kind >> 2 & 3, kind & 3
            if kind in (WRITE_ERROR, READ_ERROR):
                number, at = read_varuint(data, at)
                code, at = read_varuint(data, at)
                raise FrameError(f'the drive refuses register 0x{number:03X}, error {code}')
            if kind & 0xC0 or base == 0x30:
                raise FrameError(f'subframe 0x{kind:02X} is unknown')
            if not count:
                count, at = read_varuint(data, at)
            first, at = read_varuint(data, at)
            for number in range(first, first + count):
                known = self.by_number.get(number)
                if base == READ:
                    if known is not None:
                        asked.append(known)
                    continue
                layout = _STRUCTS[place]
                if at + layout.size > len(data):
                    raise FrameError(f'a frame of {len(data)} bytes ends within register '
                                     f'0x{number:03X}')
                raw = layout.unpack_from(data, at)[0]
                at += layout.size
                if known is not None:
                    values[known.name] = known.to_value(raw, place)
        return values, asked


def identifier(source: int, destination: int, reply: bool = False) -> int:
    """Return an identifier with its flags: extended where eleven bits do not hold it."""
    number = source << 8 | destination | REPLY_WANTED * reply
    return number | FD | (EXTENDED if number > STANDARD_MASK else 0)


def padded(data: bytes) -> bytes:
    """Return data of a length that CAN FD has, filled up by "no operation"."""
    size = next((size for size in FD_SIZES if size >= len(data)), None)
    if size is None:
        raise FrameError(f'{len(data)} bytes do not fit a CAN FD frame of 64')
    return data + bytes([NOP]) * (size - len(data))


def varuint(number: int) -> bytes:
    """Return a number in groups of seven bits, the least first; bit 7 says that more follow."""
    out = bytearray()
    while True:
        number, low = number >> 7, number & 0x7F
        out.append(low | 0x80 * (number > 0))
        if not number:
            return bytes(out)


def read_varuint(data: bytes, at: int) -> tuple[int, int]:
    """Return (number, place behind it); raises FrameError where the data ends before."""
    number = shift = 0
    while at < len(data):
        number |= (data[at] & 0x7F) << shift
        shift += 7
        at += 1
        if not data[at - 1] & 0x80:
            return number, at
    raise FrameError(f'a frame of {len(data)} bytes ends within a number')
