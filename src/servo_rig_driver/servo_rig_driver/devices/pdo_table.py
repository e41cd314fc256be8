"""
The PDOs of a rig as one table, built from the mappings in the object dictionaries.

Bytes in, named values in SI units out, and back; no I/O. A value's name is the ParameterName of
its object in snake case; objects with a Factor are floats, those without are integers. The most
negative integer of a float object stands for "not measured": NaN.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, isnan, nan
from operator import mul
import re
from struct import Struct

from canopen import ObjectDictionary
from canopen.objectdictionary import datatypes, ODVariable
import numpy as np

from .object_dictionary import Dictionaries, load_dictionaries, NODE_IDS

SYNC_ID = 0x80
NMT_ID = 0x000
HEARTBEAT_ID = 0x700  # plus the node id
SYNC_COUNTS = 240  # object 1019h

_CODES = {8: 'b', 16: 'h', 24: '3s', 32: 'i'}
_SYNCS = [bytes([1 + k]) for k in range(SYNC_COUNTS)]


class FrameError(ValueError):
    """A frame that does not fit its layout, or a value that does not fit its frame."""


def sync_frame(sequence: int) -> tuple[int, bytes]:
    """Return the SYNC of the sample with this running number; its counter is 1 + number % 240."""
    return SYNC_ID, _SYNCS[sequence % SYNC_COUNTS]


def sync_counter(sequence: int) -> int:
    """Return the counter that nodes echo in ``sample_counter`` for this running number."""
    return 1 + sequence % SYNC_COUNTS


@dataclass(frozen=True)
class Field:
    """One value of a frame: its object, size in bits, and scale; ``factor`` None is an integer."""

    name: str
    index: int
    subindex: int
    bits: int
    signed: bool
    factor: float | None
    unit: str

    @property
    def low(self) -> int:
        """Smallest integer that is a value."""
        if not self.signed:
            return 0
        return -(1 << self.bits - 1) + (self.factor is not None)

    @property
    def high(self) -> int:
        """Largest integer that is a value."""
        return (1 << self.bits - self.signed) - 1

    @property
    def not_measured(self) -> int | None:
        """The integer that stands for NaN, None for an object that always has a value."""
        return None if self.factor is None or not self.signed else -(1 << self.bits - 1)

    def to_integer(self, value: float) -> int:
        """Return the integer on the wire, held at the ends of its range; NaN as not_measured."""
        if isnan(value):
            return self.low if self.not_measured is None else self.not_measured
        return min(max(round(value / (self.factor or 1)), self.low), self.high)

    def quantise(self, values: np.ndarray) -> np.ndarray:
        """Return what arrives at the other end of the wire for an array of values; it clamps."""
        scale = self.factor or 1
        return np.clip(np.rint(np.asarray(values, float) / scale), self.low, self.high) * scale


class Frame:
    """
    One PDO: ``fields`` in the order of their bytes, ``cob_id``, ``length`` in bytes.

    ``transmitted`` is true for what a node of the rig sends (a TPDO).
    """

    def __init__(self, name: str, cob_id: int, transmitted: bool, transmission_type: int,
                 fields: Sequence[Field]) -> None:
        self.name = name
        self.cob_id = cob_id
        self.transmitted = transmitted
        self.transmission_type = transmission_type
        self.fields = tuple(fields)
        self.names = tuple(field.name for field in fields)
        codes = [_CODES[field.bits] for field in fields]
        self._struct = Struct('<' + ''.join(code if field.signed else code.upper()
                                            for code, field in zip(codes, fields, strict=True)))
        self.length = self._struct.size
        self._factors = tuple(1 if field.factor is None else field.factor for field in fields)
        self._odd = tuple(k for k, field in enumerate(fields) if field.bits == 24)
        self._empty = tuple(field.not_measured for field in fields)
        if self.length > 8:
            raise FrameError(f'{name} maps {self.length} bytes; a PDO has at most 8')

    def unpack(self, data: bytes) -> list[float]:
        """Return the values in the order of ``fields``; raises FrameError for a wrong length."""
        if len(data) != self.length:
            raise FrameError(f'frame 0x{self.cob_id:03X} ({self.name}) has {len(data)} bytes, '
                             f'expected {self.length}')
        raw = self._struct.unpack(data)
        if self._odd:
            raw = list(raw)
            for k in self._odd:
                raw[k] = int.from_bytes(raw[k], 'little', signed=self.fields[k].signed)
        values = list(map(mul, raw, self._factors))
        for k, empty in enumerate(self._empty):
            if raw[k] == empty:
                values[k] = nan
        return values

    def pack(self, values: Sequence[float], clamp: bool = False) -> bytes:
        """
        Return the bytes for values in the order of ``fields``.

        Raises FrameError for a value out of range, unless ``clamp`` holds it at its end as a
        sensor would, and for NaN in what a node receives.
        """
        raw = list(map(round, map(self._whole, range(len(self.fields)), values)))
        for k, field in enumerate(self.fields):
            if not field.low <= raw[k] <= field.high and raw[k] != field.not_measured:
                if not clamp:
                    raise self._refusal(field, values[k])
                raw[k] = min(max(raw[k], field.low), field.high)
        for k in self._odd:
            raw[k] = raw[k].to_bytes(3, 'little', signed=self.fields[k].signed)
        return self._struct.pack(*raw)

    def decode(self, data: bytes) -> dict[str, float]:
        """Return the values by name; raises FrameError for a wrong length."""
        return dict(zip(self.names, self.unpack(data), strict=True))

    def encode(self, values: Mapping[str, float]) -> bytes:
        """Return the bytes for values by name; raises FrameError for a missing or unknown name."""
        if set(values) != set(self.names):
            raise FrameError(f'{self.name} carries {list(self.names)}, given are {list(values)}')
        return self.pack([values[name] for name in self.names])

    def _whole(self, k: int, value: float) -> float:
        scaled = value / self._factors[k]
        if isfinite(scaled):
            return scaled
        if self.transmitted and isnan(scaled) and self._empty[k] is not None:
            return self._empty[k]
        raise self._refusal(self.fields[k], value)

    def _refusal(self, field: Field, value: float) -> FrameError:
        scale = 1 if field.factor is None else field.factor
        return FrameError(f'{self.name}: {field.name} = {value} {field.unit} is outside '
                          f'[{field.low * scale:g}, {field.high * scale:g}]')

    def __repr__(self) -> str:
        """Name, identifier, direction and fields."""
        return (f'<{self.name} 0x{self.cob_id:03X} {self.length} bytes: '
                + ', '.join(f'{f.name} [{f.unit}]' for f in self.fields) + '>')


class FrameTable(Mapping[str, Frame]):
    """All PDOs of a rig by name ('drive.tpdo1', 'torque_sensor.rpdo1'); ``by_id`` by COB-ID."""

    def __init__(self, dictionaries: Dictionaries) -> None:
        self.dictionaries = dictionaries
        self.ids = dictionaries.ids
        self._frames: dict[str, Frame] = {}
        for node, od in dictionaries.nodes.items():
            try:
                self._frames.update({frame.name: frame for frame in _frames(node, od)})
            except (KeyError, TypeError, AttributeError, IndexError) as error:
                raise FrameError(f'{dictionaries.folder / node}.eds: its PDO mappings do not '
                                 f'fit its objects: {error}') from None
        self.by_id = {frame.cob_id: frame for frame in self._frames.values()}

    def __getitem__(self, name: str) -> Frame:
        """Return a frame; raises KeyError that names what there is."""
        try:
            return self._frames[name]
        except KeyError:
            raise KeyError(f"no frame '{name}'; there are {list(self._frames)}") from None

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._frames)

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._frames)

    def field(self, node: str, name: str) -> Field:
        """Return the field of a node that has this name, in whichever frame; raises KeyError."""
        for frame in self._frames.values():
            if frame.name.startswith(node + '.') and name in frame.names:
                return frame.fields[frame.names.index(name)]
        raise KeyError(f"no frame of '{node}' carries '{name}'")


def load_frames(name: str = 'rv_bench', ids: Mapping[str, int] = NODE_IDS) -> FrameTable:
    """Return the table of a shipped set of object dictionaries, or of a folder of them."""
    return FrameTable(load_dictionaries(name, ids))


def _frames(node: str, od: ObjectDictionary) -> Iterator[Frame]:
    for first, kind in ((0x1400, 'rpdo'), (0x1800, 'tpdo')):
        for index in range(first, first + 8):
            if index not in od:
                continue
            entries = [od[index + 0x200][k].default
                       for k in range(1, od[index + 0x200][0].default + 1)]
            yield Frame(f'{node}.{kind}{index - first + 1}', od[index][1].default,
                        kind == 'tpdo', od[index][2].default,
                        [_field(od, entry) for entry in entries])


def _field(od: ObjectDictionary, entry: int) -> Field:
    index, subindex, bits = entry >> 16, entry >> 8 & 0xFF, entry & 0xFF
    thing = od[index] if isinstance(od[index], ODVariable) else od[index][subindex]
    if bits not in _CODES or bits != len(thing):
        raise FrameError(f'object {index:04X}h:{subindex} ({thing.name}) has {len(thing)} bits, '
                         f'mapped are {bits}; a PDO here carries objects of 8, 16, 24 or 32 bits')
    # canopen's factor is the integer 1 where the file has no Factor
    factor = thing.factor if isinstance(thing.factor, float) else None
    return Field(re.sub(r'\W+', '_', thing.name).lower(), index, subindex, bits,
                 thing.data_type in datatypes.SIGNED_TYPES, factor, thing.unit)
