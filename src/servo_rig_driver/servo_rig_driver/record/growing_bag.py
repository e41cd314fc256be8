"""A bag that grows on disk: rosbags' MCAP writer, with its chunks written out in time."""

from __future__ import annotations

from contextlib import suppress
from os import fstat, SEEK_END
from os.path import samestat
from pathlib import Path
import sys
from time import monotonic
from typing import BinaryIO

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import (
    CompressionFormat,
    CompressionMode,
    StoragePlugin,
    Writer,
    WriterError,
)

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

from .chunk_index import ChunkIndex
from .message_definitions import commented, typestore

NO_ROOM = (OSError, MemoryError, zstd.ZstdError)
"""What writing raises where the disk or the memory is full."""

_FOREVER = QosTime(9223372036, 854775807)
_HEAD = 31  # bytes of an MCAP message before its data
_NUMBER = 11  # bytes before its running number, which rosbags leaves at 0


class RecordingFile:
    """
    Writes raw messages to a rosbag2 directory with MCAP storage and zstd chunks.

    ``topics`` maps full topic names to message types, ``latched`` names those that are transient
    local. A chunk goes to disk when it holds ``chunk_bytes`` or, with :meth:`flush`, when its
    first message is ``chunk_seconds`` old: a killed process loses no more. Raises
    FileExistsError when ``path`` exists, FileNotFoundError for a type without a definition, and
    where the file is found to be removed or moved as a chunk is written.
    """

    def __init__(self, path: Path, topics: dict[str, str], shares: list[Path],
                 latched: frozenset[str] = frozenset(), chunk_bytes: int = 1 << 20,
                 chunk_seconds: float = 0.5) -> None:
        there = f'{path} exists already; choose another output or remove it'
        if path.exists():
            raise FileExistsError(there)
        self.path = path
        self.counts = dict.fromkeys(topics, 0)
        self._chunk_bytes, self._chunk_seconds = chunk_bytes, chunk_seconds
        self._began: float | None = None
        types = typestore(sorted(set(topics.values())), shares)
        try:
            self._writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
        except (WriterError, FileExistsError):  # another one has made it meanwhile
            raise FileExistsError(there) from None
        self._index = self._writer.storage.chunks = ChunkIndex(path)
        self._connections: dict[str, Connection] = {
            topic: self._writer.add_connection(
                topic, kind, msgdef=commented(types, kind, shares), rihs01=types.hash_rihs01(kind),
                offered_qos_profiles=[_qos(topic in latched)])
            for topic, kind in topics.items()}

    @property
    def pending(self) -> float:
        """Since when messages wait that are not on disk, s."""
        return 0.0 if self._began is None else monotonic() - self._began

    def write(self, topic: str, time: int, data: bytes) -> None:
        """Write one serialized message received at ``time``, ns."""
        chunk = self._writer.storage.chunk.bio
        if self._began is not None and chunk.tell() + _HEAD + len(data) > self._chunk_bytes:
            self.flush(now=True)
            chunk = self._writer.storage.chunk.bio
        begin = chunk.tell()
        self._writer.write(self._connections[topic], time, data)
        if self._writer.storage.chunk.bio is chunk:  # rosbags closes a chunk of more than 1 MiB
            chunk.seek(begin + _NUMBER)
            chunk.write((self.counts[topic] & 0xFFFFFFFF).to_bytes(4, 'little'))
            chunk.seek(0, SEEK_END)
        self.counts[topic] += 1
        if self._began is None:
            self._began = monotonic()

    def flush(self, now: bool = False) -> None:
        """Write the pending chunk out when it is old enough, or ``now``."""
        if self._began is None or not (now or self.pending >= self._chunk_seconds):
            return
        storage = self._writer.storage
        try:
            if storage.chunk.msgs:
                storage.close_chunk()
            storage.bio.flush()
        except OSError as error:  # of a full disk says no name
            raise OSError(error.errno, error.strerror, storage.bio.name) from None
        self._began = None
        self._look_for(storage.bio)

    def _look_for(self, file: BinaryIO) -> None:
        """Raise FileNotFoundError where what is written is no longer what its path names."""
        with suppress(FileNotFoundError, NotADirectoryError):
            if samestat(Path(file.name).stat(), fstat(file.fileno())):
                return
        raise FileNotFoundError(f'{file.name} was removed or moved while it was written; what '
                                'came since would be lost, or lies where it was moved to')

    def close(self) -> None:
        """Write the summary and metadata.yaml."""
        self._writer.close()
        self._index.close()

    def abort(self) -> None:
        """Close without summary, leaving what is on disk; after an error in writing."""
        with suppress(*NO_ROOM):
            self._writer.abort()
            self._index.close()


def _qos(latched: bool) -> Qos:
    durability = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
    return Qos(QosHistory.KEEP_LAST, 1000, QosReliability.RELIABLE, durability, _FOREVER,
               _FOREVER, QosLiveliness.AUTOMATIC, _FOREVER, False)
