"""Where a bag's messages come from: MCAP files read by chunk, anything else through rosbags."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
import re
from typing import Any, Self

import numpy as np

from .bag_writing import BagError
from .fits_in_memory import check_fits
from .mcap_reading import Channel, Chunk, DAMAGE, rows, Scan, scan
from .metadata_file import metadata_of

_LARGEST_RATIO = 1000  # of a chunk's size to its compressed one: a larger one is a damaged head
_WINDOW = 10 * 10**9  # ns of messages that are read at once through rosbags
_MOST_WINDOWS = 10_000  # metadata.yaml may lie about the time

Rows = Iterable[np.ndarray]
"""Payloads of messages, those of equal length together."""

Piece = tuple[Channel, int | None, int | None]
"""A channel and the time, ns, from which to which its messages are read."""


class Source:
    """
    A bag, open for reading.

    ``channels`` lists its topics once each. ``pieces`` gives handles of independent stretches of
    the bag in the order of its files; ``load`` turns one into (channel, rows) pairs. ``parallel``:
    whether several threads may load at once.
    """

    path: Path
    files: list[Path]
    channels: list[Channel]
    warnings: list[str]
    parallel = False

    def pieces(self, topics: list[str]) -> Iterator[Any]:
        """Yield handles of the stretches that may hold messages of ``topics``."""
        raise NotImplementedError

    def load(self, piece: Any, topics: list[str]) -> Iterator[tuple[Channel, Rows]]:
        """Yield the channels of ``topics`` in a stretch; raises DAMAGE for a damaged one."""
        raise NotImplementedError

    def glance(self, piece: Any, topics: list[str]) -> Iterator[tuple[Channel, int, np.ndarray]]:
        """
        Yield (channel, messages, payload of the first) where that can be had for little.

        Raises DAMAGE.
        """
        yield from ()

    def describe(self, piece: Any) -> str:
        """Name a stretch for a message."""
        raise NotImplementedError

    def first(self, topic: str) -> bytes | None:
        """Return the payload of the first whole message on a topic."""
        for piece in self.pieces([topic]):
            try:
                for _, found in self.load(piece, [topic]):
                    for payloads in found:
                        return bytes(payloads[0])
            except DAMAGE:
                continue
        return None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass


class McapSource(Source):
    """MCAP files, in the order of the recording."""

    parallel = True

    def __init__(self, path: Path, files: list[Path]) -> None:
        self.path, self.files, self.warnings = path, files, []
        try:
            self._scans = [scan(file) for file in files]
        except ValueError as error:
            raise BagError(str(error)) from None
        check_fits(path, max((chunk.plain_size for part in self._scans for chunk in part.chunks
                              if chunk.plain_size <= _LARGEST_RATIO * max(1, chunk.size)),
                             default=0))
        by_topic: dict[str, Channel] = {}
        for part in self._scans:
            for channel in part.channels.values():
                seen = by_topic.setdefault(channel.topic, channel)
                if seen.kind != channel.kind:
                    raise BagError(f'{path}: topic {channel.topic} has two types, {seen.kind} '
                                   f'and {channel.kind}')
            self.warnings += part.damaged
            if part.cut:
                whole = len(part.chunks)
                self.warnings.append(f'the bag was cut: {part.cut}; {whole} whole chunks are read')
        self.channels = list(by_topic.values())

    def pieces(self, topics: list[str]) -> Iterator[tuple[Scan, Chunk]]:
        """Yield (file, chunk) pairs."""
        for part in self._scans:
            wanted = {number for number, c in part.channels.items() if c.topic in topics}
            for chunk in part.chunks:
                index = part.index(chunk)
                if index is None or not wanted.isdisjoint(index):
                    yield part, chunk

    def load(self, piece: tuple[Scan, Chunk],
             topics: list[str]) -> Iterator[tuple[Channel, Rows]]:
        """Yield the channels of a chunk."""
        part, chunk = piece
        content = part.content(chunk)
        for number, places in part.offsets(chunk, content).items():
            channel = part.channels.get(number)
            if channel is not None and channel.topic in topics and len(places):
                if channel.serialization != 'cdr':
                    raise ValueError(f'{channel.topic} is serialized as {channel.serialization}')
                yield channel, rows(content, places)

    def glance(self, piece: tuple[Scan, Chunk],
               topics: list[str]) -> Iterator[tuple[Channel, int, np.ndarray]]:
        """Yield the channels of a chunk."""
        part, chunk = piece
        for number, (count, payload) in part.firsts(chunk).items():
            channel = part.channels.get(number)
            if channel is not None and channel.topic in topics:
                yield channel, count, payload

    def describe(self, piece: tuple[Scan, Chunk]) -> str:
        """Name a chunk by its file and place."""
        return f'the chunk at byte {piece[1].offset} of {piece[0].path.name}'


class ForeignSource(Source):
    """Any other rosbag2 directory (SQLite, compressed files or messages), read by rosbags."""

    def __init__(self, path: Path) -> None:
        from rosbags.interfaces import MessageDefinitionFormat
        from rosbags.rosbag2 import Reader, ReaderError

        from .message_definitions import own_types

        self.path, self.warnings = path, []
        self.files = sorted(file for file in path.iterdir() if file.suffix != '.yaml')
        try:
            self._reader = Reader(path)
            self._reader.open()
        except (ReaderError, OSError) as error:
            raise BagError(f'{path}: {error}') from None
        self.channels = []
        for connection in self._reader.connections:
            definition = connection.msgdef
            encoding = {MessageDefinitionFormat.MSG: 'ros2msg',
                        MessageDefinitionFormat.IDL: 'ros2idl'}.get(definition.format)
            content = definition.data
            if encoding is None and connection.msgtype in own_types().fielddefs:
                encoding = 'ros2msg'
                content = own_types().generate_msgdef(connection.msgtype, ros_version=2)[0]
            self.channels.append(Channel(connection.id, connection.topic, connection.msgtype,
                                         encoding or '', content, 'cdr'))

    def pieces(self, topics: list[str]) -> Iterator[Piece]:
        """Yield (channel, from, to) of every stretch of time, ns; None: all that is beyond."""
        begin, end = self._reader.start_time, self._reader.end_time
        inner = range(begin, end, max(_WINDOW, (end - begin) // _MOST_WINDOWS))[1:]
        for stretch in pairwise([None, *inner, None]):
            for channel in self.channels:
                if channel.topic in topics:
                    yield channel, *stretch

    def load(self, piece: Piece, topics: list[str]) -> Iterator[tuple[Channel, Rows]]:
        """Yield one channel, its messages of equal length together."""
        channel, begin, end = piece
        chosen = [c for c in self._reader.connections if c.topic == channel.topic]
        found: dict[int, list[bytes]] = {}
        for _, _, data in self._reader.messages(chosen, begin, end):
            found.setdefault(len(data), []).append(bytes(data))
        yield channel, (np.frombuffer(b''.join(several), np.dtype((np.void, length)))
                        for length, several in found.items())

    def describe(self, piece: Piece) -> str:
        """Name a channel and a time."""
        return f'topic {piece[0].topic} from {(piece[1] or 0) / 1e9:.3f} s on'

    def __exit__(self, *_: object) -> None:
        self._reader.close()


def open_source(path: Path) -> Source:
    """Open a bag: a rosbag2 directory or one .mcap file. Raises BagError for what is neither."""
    if path.is_file():
        if path.suffix != '.mcap':
            raise BagError(f'{path} is no bag: give a rosbag2 directory or an .mcap file')
        return McapSource(path, [path])
    if not path.is_dir():
        raise BagError(f'{path} does not exist')
    information = metadata_of(path)
    names = information.get('relative_file_paths')
    listed = [path / name for name in names if isinstance(name, str)] if isinstance(
        names, list) else []
    inside = [file for file in listed if path.resolve() in file.resolve().parents]
    files = [file for file in inside if file.is_file()] if listed else _natural(path)
    if information.get('compression_mode') or any(file.suffix != '.mcap' for file in files):
        return ForeignSource(path)
    missing = [file.name for file in listed if file not in files]
    if not files:
        tables = any(path.glob('*.csv'))
        raise BagError(f'{path} is no bag: it has no .mcap file'
                       + (f' (metadata.yaml names {missing})' if missing else '')
                       + (f"; it holds tables, which are '{path}/*.csv'" if tables else ''))
    source = McapSource(path, files)
    if missing:
        source.warnings.append(f'metadata.yaml names files that are not there: {missing}')
    return source


def _natural(path: Path) -> list[Path]:
    return sorted(path.glob('*.mcap'), key=lambda file: [
        int(part) if part.isdigit() else part for part in re.split(r'(\d+)', file.name)])
