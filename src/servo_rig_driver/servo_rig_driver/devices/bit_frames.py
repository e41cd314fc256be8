"""
Frames of bit fields, most significant bit first, as a YAML table has them.

A field is a line "name bits", "name bits = constant" or "name bits little" (bytes of a number in
the order of little-endian machines). A frame has a row of fields in its identifier and one in its
data. Names in `ranges` are numbers of a range: 0 is `low`, all bits set is `high`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
import re

from .device import DeviceError
from .pdo_table import FrameError

_LINE = re.compile(r'(\w+) (\d+)(?: = (\w+))?( little)?')


@dataclass(frozen=True)
class Range:
    """The numbers that an unsigned integer stands for, from ``low`` to ``high``."""

    low: float
    high: float

    def __post_init__(self) -> None:
        """Raise DeviceError for ends that are not finite and in order."""
        if not (isfinite(self.low) and isfinite(self.high) and self.low < self.high):
            raise DeviceError(f'range [{self.low:g}, {self.high:g}]: its ends must be finite, the '
                              'first one below the second')

    def to_integer(self, value: float, bits: int) -> int:
        """
        Return the integer of a number held at the ends of the range.

        It is truncated, as in the routine `float_to_uint` of the vendors' manuals.
        """
        held = min(max(value, self.low), self.high)
        return int((held - self.low) * ((1 << bits) - 1) / (self.high - self.low))

    def to_number(self, integer: int, bits: int) -> float:
        """Return the number of an integer, as `uint_to_float` of the vendors' manuals."""
        return integer * (self.high - self.low) / ((1 << bits) - 1) + self.low


@dataclass(frozen=True)
class BitField:
    """One field: its bits, and its constant, or the range of its numbers, or neither."""

    name: str
    bits: int
    constant: int | None
    little: bool
    range: Range | None

    def pack(self, values: Mapping[str, float]) -> int:
        """Return the bits; raises FrameError for a value that is missing or does not fit."""
        if self.constant is not None:
            return self.constant
        if self.name not in values:
            raise FrameError(f'{self.name} is missing; given are {list(values)}')
        value = values[self.name]
        raw = int(value) if self.range is None else self.range.to_integer(value, self.bits)
        if not 0 <= raw < 1 << self.bits:
            raise FrameError(f'{self.name} = {value} does not fit {self.bits} bits')
        return self._swapped(raw) if self.little else raw

    def unpack(self, raw: int) -> float:
        """Return the value of the bits."""
        raw = self._swapped(raw) if self.little else raw
        return raw if self.range is None else self.range.to_number(raw, self.bits)

    def _swapped(self, raw: int) -> int:
        size = self.bits // 8
        return int.from_bytes(raw.to_bytes(size, 'little'), 'big')


class BitRow:
    """Fields side by side, the first one in the most significant bits; ``bits`` in all."""

    def __init__(self, fields: list[BitField]) -> None:
        self.fields = fields
        self.bits = sum(field.bits for field in fields)

    def pack(self, values: Mapping[str, float]) -> int:
        """Return the bits of all fields."""
        packed = 0
        for field in self.fields:
            packed = packed << field.bits | field.pack(values)
        return packed

    def unpack(self, packed: int) -> dict[str, float] | None:
        """Return the values by name; None where a constant is another one."""
        values: dict[str, float] = {}
        for field in reversed(self.fields):
            raw = packed & (1 << field.bits) - 1
            packed >>= field.bits
            if field.constant is not None:
                if raw != field.constant:
                    return None
                continue
            values[field.name] = field.unpack(raw)
        return values


class BitFrame:
    """One frame: the fields of its identifier, and those of its data."""

    def __init__(self, name: str, identifier: BitRow, data: BitRow) -> None:
        self.name = name
        self.identifier = identifier
        self.data = data
        self.length = data.bits // 8

    @property
    def fields(self) -> set[str]:
        """The names of all fields."""
        return {field.name for row in (self.identifier, self.data) for field in row.fields}

    def pack(self, values: Mapping[str, float]) -> tuple[int, bytes]:
        """Return (identifier, data) for values by name; raises FrameError for unfit ones."""
        return self.identifier.pack(values), self.data.pack(values).to_bytes(self.length, 'big')

    def unpack(self, identifier: int, data: bytes) -> dict[str, float] | None:
        """
        Return the values of a frame by name; None for another frame.

        Raises FrameError for a wrong length.
        """
        told = self.identifier.unpack(identifier)
        if told is None:
            return None
        if len(data) != self.length:
            raise FrameError(f'frame 0x{identifier:X} ({self.name}) has {len(data)} bytes, '
                             f'expected {self.length}')
        values = self.data.unpack(int.from_bytes(data, 'big'))
        return None if values is None else told | values


def bit_frame(name: str, lines: Mapping[str, list[str]], ranges: Mapping[str, Range],
              identifier_bits: int) -> BitFrame:
    """Return the frame of a table; raises DeviceError for one that is no frame."""
    rows = {part: BitRow([_field(name, line, ranges) for line in lines.get(part, ())])
            for part in ('identifier', 'data')}
    if rows['identifier'].bits != identifier_bits:
        raise DeviceError(f"frame '{name}': its identifier has {rows['identifier'].bits} bits, "
                          f'{identifier_bits} are needed')
    names = [field.name for row in rows.values() for field in row.fields
             if field.constant is None]
    doubled = sorted({one for one in names if names.count(one) > 1})
    if doubled:
        raise DeviceError(f"frame '{name}': {doubled} are there twice")
    if rows['data'].bits % 8 or rows['data'].bits > 64:
        raise DeviceError(f"frame '{name}': its data has {rows['data'].bits} bits; whole bytes "
                          'are needed, at most eight')
    return BitFrame(name, rows['identifier'], rows['data'])


def _field(frame: str, line: str, ranges: Mapping[str, Range]) -> BitField:
    found = _LINE.fullmatch(str(line))
    if found is None:
        raise DeviceError(f"frame '{frame}': field '{line}' must read 'name bits', 'name bits = "
                          "constant' or 'name bits little'")
    name, bits, constant, little = found.groups()
    size, value = int(bits[:4]), None if constant is None else int(constant, 0)
    if not 1 <= size <= 64 or (little and size % 8) or (value or 0) >> size:
        raise DeviceError(f"frame '{frame}': field '{line}' must have 1 to 64 bits, whole bytes "
                          "where it is 'little', and a constant that fits them")
    return BitField(name, size, value, bool(little), ranges.get(name))
