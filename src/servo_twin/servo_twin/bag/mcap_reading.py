"""
The MCAP container, read: which chunks and topics a file has, also when its end is missing.

The file is walked record by record, jumping over the chunks' contents, so that a file without
summary, footer or its last half chunk reads the same way as a whole one. Nothing is written. Of
each chunk only its place is kept; what was read of the file is given back to the system.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
import mmap
from pathlib import Path
from struct import error as StructError
from struct import unpack_from
from sys import intern
from typing import NamedTuple
import zlib

import numpy as np

from .mcap_writing import (
    CHANNEL,
    CHUNK,
    FOOTER,
    LENGTH_BEFORE_PAYLOAD,
    MAGIC,
    MESSAGE,
    MESSAGE_HEAD,
    MESSAGE_INDEX,
    SCHEMA,
    zstd,
)

_KNOWN = range(1, 16)
_PIECE = 100_000  # bytes decompressed at once: malloc keeps such pieces, and clears larger ones
_AROUND = 1 << 16  # bytes that the system reads along with those that are asked for
_LOOSE = 1 << 22  # bytes of messages outside of chunks that are read at once

DAMAGE = (ArithmeticError, LookupError, MemoryError, StructError, TypeError, ValueError)
"""What taking damaged bytes apart may raise."""


class Channel(NamedTuple):
    """A topic of a file, with the definition of its message as the file has it."""

    number: int
    topic: str
    kind: str
    encoding: str
    definition: str
    serialization: str


@dataclass(slots=True)
class Chunk:
    """
    A stretch of message records; ``index`` is where in the file the records of its index lie.

    ``compression`` is zstd, lz4 or empty. Without an index, (0, 0), the records must be walked.
    ``loose`` are messages that stand in no chunk.
    """

    offset: int
    size: int
    plain_size: int
    compression: str
    checksum: int
    index: tuple[int, int] = (0, 0)
    loose: bool = False


@dataclass
class Scan:
    """What a file holds; ``cut`` says how its end is missing, ``damaged`` what makes no sense."""

    path: Path
    data: mmap.mmap
    chunks: list[Chunk] = field(default_factory=list)
    channels: dict[int, Channel] = field(default_factory=dict)
    cut: str = ''
    damaged: list[str] = field(default_factory=list)

    def content(self, chunk: Chunk) -> np.ndarray:
        """Return the records of a chunk, uint8; raises ValueError when they are damaged."""
        stored = memoryview(self.data)[chunk.offset:chunk.offset + chunk.size]
        try:
            if chunk.compression == 'zstd':
                plain = _decompressed(stored, chunk.plain_size, chunk.plain_size + 1)
            elif chunk.compression == 'lz4':
                from lz4.frame import decompress
                plain = np.frombuffer(decompress(stored), np.uint8)
            elif not chunk.compression:
                plain = np.frombuffer(bytes(stored), np.uint8)
            else:
                raise ValueError(f'compression {chunk.compression!r}; known are zstd and lz4')
        except (RuntimeError, MemoryError) as error:
            raise ValueError(str(error)) from None
        if len(plain) != chunk.plain_size:
            raise ValueError(f'{len(plain)} bytes where its head says {chunk.plain_size}')
        if chunk.checksum and zlib.crc32(plain) != chunk.checksum:
            raise ValueError('its checksum does not match')
        self.give_back(chunk.offset, chunk.size)
        return plain

    def firsts(self, chunk: Chunk) -> dict[int, tuple[int, np.ndarray]]:
        """
        Return by channel how many messages a chunk has, and the payload of the first, shape (1,).

        Only the beginning of the chunk is decompressed. Empty without an index, or without zstd.
        """
        index = self.index(chunk)
        if index is None or chunk.compression != 'zstd':
            return {}
        begins = {number: (entries, unpack_from('<Q', self.data, offset + 8)[0])
                  for number, (offset, entries) in index.items() if entries}
        self.give_back(chunk.index[0], chunk.index[1] - chunk.index[0])
        enough = max((place for _, place in begins.values()), default=0) + _PIECE
        stored = memoryview(self.data)[chunk.offset:chunk.offset + chunk.size]
        content = _decompressed(stored, chunk.plain_size, enough)
        self.give_back(chunk.offset, chunk.size)
        return {number: (entries, payload) for number, (entries, place) in begins.items()
                for payload in rows(content, np.array([place], np.int64))}

    def give_back(self, begin: int, size: int) -> None:
        """Let the system have the memory back in which bytes of the file stood."""
        first = max(0, begin - _AROUND) // mmap.PAGESIZE * mmap.PAGESIZE
        if size > 0 and first < len(self.data):
            self.data.madvise(mmap.MADV_DONTNEED, first, begin + size + _AROUND - first)

    def index(self, chunk: Chunk) -> dict[int, tuple[int, int]] | None:
        """Return for each channel of a chunk (where its list of places is, entries), or None."""
        if chunk.index == (0, 0):
            return None
        found = {unpack_from('<H', self.data, begin)[0]: (begin + 6, (end - begin - 6) // 16)
                 for opcode, begin, end in _records(self.data, *chunk.index)
                 if opcode == MESSAGE_INDEX and end >= begin + 6}
        self.give_back(chunk.index[0], chunk.index[1] - chunk.index[0])
        return found if found.keys() <= self.channels.keys() else None

    def offsets(self, chunk: Chunk, content: np.ndarray) -> dict[int, np.ndarray]:
        """Return the places of the messages of a chunk by channel, in the order of the file."""
        index = self.index(chunk)
        if index is not None:
            places = {number: np.frombuffer(self.data, '<u8', 2 * entries, offset)[1::2].astype(
                np.int64) for number, (offset, entries) in index.items() if entries}
            self.give_back(chunk.index[0], chunk.index[1] - chunk.index[0])
            return places
        found: dict[int, list[int]] = {}
        for opcode, begin, _ in _records(content.data, 0, len(content)):
            if opcode == MESSAGE:
                found.setdefault(unpack_from('<H', content, begin)[0], []).append(begin - 9)
        return {number: np.array(places) for number, places in found.items()}


def _decompressed(stored: memoryview | bytes, size: int, enough: int) -> np.ndarray:
    """
    Return what zstd frames hold, uint8, or ``enough`` bytes of it and more.

    Raises ValueError where it is more than ``size``.
    """
    plain, at = np.empty(min(size, enough + _PIECE), np.uint8), 0
    while len(stored) and at < enough:
        frame = zstd.ZstdDecompressor()
        while not frame.eof and at < enough:
            try:
                piece = frame.decompress(stored, max_length=_PIECE)
            except zstd.ZstdError as error:
                raise ValueError(str(error)) from None
            stored = b''
            if not piece and frame.needs_input:
                raise ValueError('its data end too early')
            if at + len(piece) > len(plain):
                raise ValueError(f'more than the {size} bytes that its head says')
            plain[at:at + len(piece)] = np.frombuffer(piece, np.uint8)
            at += len(piece)
        stored = frame.unused_data
    return plain[:at]


def scan(path: Path) -> Scan:
    """
    Walk one MCAP file.

    Raises ValueError when the file does not begin as an MCAP file does.
    """
    with path.open('rb') as file:
        head = file.read(len(MAGIC))
        if head != MAGIC:
            said = 'is empty' if not head else f'begins with {head!r} and not with {MAGIC!r}'
            raise ValueError(f'{path} is no MCAP file: it {said}')
        data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    result = Scan(path, data)
    schemas: dict[int, tuple[str, str, str]] = {}
    end = given = len(MAGIC)
    finished = False
    for opcode, begin, after in _records(data, len(MAGIC), len(data)):
        end = after
        finished = opcode == FOOTER
        if finished:
            break
        try:
            _take(result, opcode, begin, after, schemas)
        except DAMAGE as error:
            result.damaged.append(f'the record at byte {begin - 9} of {path.name} is damaged and '
                                  f'left out: {error}')
        if after - given > _LOOSE:
            result.give_back(given, after - given)
            given = after
    result.give_back(given, len(data) - given)
    if not finished:
        result.cut = (f'{path.name} ends after byte {len(data)} without a footer; '
                      f'the last whole record ends at byte {end}')
        if result.chunks:
            result.chunks[-1].index = (0, 0)
    _announce_inside(result, schemas)
    return result


def _take(result: Scan, opcode: int, begin: int, end: int,
          schemas: dict[int, tuple[str, str, str]]) -> None:
    """Take in one record of the file."""
    data = result.data
    if opcode == CHUNK:
        result.chunks.append(_chunk(data, begin, end))
    elif opcode == MESSAGE_INDEX and result.chunks and not result.chunks[-1].loose:
        chunk = result.chunks[-1]
        chunk.index = (chunk.index[0] or begin - 9, end)
    elif opcode == MESSAGE:
        _take_loose(result, begin - 9, end)
    elif opcode in (SCHEMA, CHANNEL):
        _announce(data, opcode, begin, schemas, result.channels)


def _records(data: mmap.mmap | memoryview, begin: int,
             size: int) -> Iterator[tuple[int, int, int]]:
    """Yield (opcode, begin, end) of the bodies of all whole records."""
    while begin + 9 <= size:
        opcode, length = unpack_from('<BQ', data, begin)
        end = begin + 9 + length
        if end > size or (opcode not in _KNOWN and opcode < 0x80):
            return
        yield opcode, begin + 9, end
        begin = end


def _text(data: mmap.mmap | np.ndarray, offset: int) -> tuple[str, int]:
    length = unpack_from('<I', data, offset)[0]
    end = offset + 4 + length
    return bytes(data[offset + 4:end]).decode('utf8', 'replace'), end


def _chunk(data: mmap.mmap, begin: int, end: int) -> Chunk:
    plain_size, checksum = unpack_from('<QI', data, begin + 16)
    compression, offset = _text(data, begin + 28)
    compression = intern(compression)
    size = unpack_from('<Q', data, offset)[0]
    return Chunk(offset + 8, min(size, end - offset - 8), plain_size, compression, checksum)


def _announce(data: mmap.mmap | np.ndarray, opcode: int, begin: int,
              schemas: dict[int, tuple[str, str, str]], channels: dict[int, Channel]) -> None:
    """Take in a schema or channel record; numpy arrays and maps serve alike."""
    number = unpack_from('<H', data, begin)[0]
    if opcode == SCHEMA:
        kind, offset = _text(data, begin + 2)
        encoding, offset = _text(data, offset)
        schemas[number] = (kind, encoding, _text(data, offset)[0])
    elif number not in channels:
        schema = unpack_from('<H', data, begin + 2)[0]
        topic, offset = _text(data, begin + 4)
        serialization = _text(data, offset)[0]
        channels[number] = Channel(number, topic, *schemas.get(schema, ('', '', '')),
                                   serialization)


def _announce_inside(result: Scan, schemas: dict[int, tuple[str, str, str]]) -> None:
    """Find the channels that are announced only inside chunks, as in a file without summary."""
    for chunk in result.chunks:
        if chunk.loose or result.index(chunk) is not None:
            continue
        try:
            content = result.content(chunk)
            for opcode, begin, _ in _records(content.data, 0, len(content)):
                if opcode in (SCHEMA, CHANNEL):
                    _announce(content, opcode, begin, schemas, result.channels)
        except DAMAGE:
            continue  # said when its messages are asked for


def _take_loose(result: Scan, begin: int, end: int) -> None:
    """Take in a message that stands in no chunk, as some writers leave them."""
    last = result.chunks[-1] if result.chunks else None
    if last is not None and last.loose and last.offset + last.size == begin and (
            last.size < _LOOSE):
        last.size = last.plain_size = end - last.offset
    else:
        result.chunks.append(Chunk(begin, end - begin, end - begin, '', 0, loose=True))


def rows(content: np.ndarray, places: np.ndarray) -> Iterator[np.ndarray]:
    """
    Yield payloads of messages of equal length, shape (n,) and type void.

    Most topics have one length; every further one is yielded apart, in the order of the file.
    """
    lengths = _gather(content, places, MESSAGE_HEAD)['length'].astype(np.int64)
    found = lengths[:1] if (lengths == lengths[0]).all() else np.unique(lengths)
    for length in found:
        same = places if len(found) == 1 else places[lengths == length]
        kind = np.dtype((np.void, int(length) - LENGTH_BEFORE_PAYLOAD))
        yield _gather(content, same + MESSAGE_HEAD.itemsize, kind)


def _gather(content: np.ndarray, places: np.ndarray, kind: np.dtype) -> np.ndarray:
    """Copy one item of type ``kind`` from each place, which must lie within the content."""
    last = len(content) - kind.itemsize
    if last < 0 or places.min() < 0 or places.max() > last:
        raise ValueError('its index points outside of it')
    if len(places) > 2:
        step = int(places[1] - places[0])
        if step > 0 and (np.diff(places) == step).all():
            return np.ndarray((len(places),), kind, content, int(places[0]), (step,))
    return np.ndarray((last + 1,), kind, content, 0, (1,))[places]
