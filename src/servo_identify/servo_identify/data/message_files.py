"""
Files of messages, whoever wrote them: rosbag2 folders, MCAP, ROS 1 bags.

Each message comes as what its encoding makes of it: an object with attributes (ROS, protobuf) or
a dictionary (JSON). The definitions are those that the file holds.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from struct import error as StructError
from typing import Any, NamedTuple, Protocol

from .ros_decoder import cdr_decoder
from .sqlite_file import opened_sqlite, SqliteFile

SUFFIXES = ('.mcap', '.db3', '.bag')


class Message(NamedTuple):
    """One message: its topic, the name of its type, when it was received (ns), and itself."""

    topic: str
    kind: str
    received: int
    content: Any


class MessageFile(Protocol):
    """A file of messages, open."""

    topics: dict[str, str]
    """Topic: name of its type."""

    count: int
    """Number of messages on all topics."""

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of topics in the order of the file."""
        ...


def holds_messages(path: Path) -> bool:
    """Tell whether a path is that of a rosbag2 folder or of a file of messages."""
    if path.is_dir():
        return (path / 'metadata.yaml').is_file() or any(path.glob('*.mcap')) or any(
            path.glob('*.db3'))
    return path.suffix.lower() in SUFFIXES and path.is_file()


def count_of_messages(path: Path) -> int:
    """Return how many messages a file of them holds; 0 where it cannot be read."""
    try:
        with opened(path) as file:
            return file.count
    except (ValueError, OSError):
        return 0  # what is wrong with it is said when it is read


@contextmanager
def opened(path: Path) -> Iterator[MessageFile]:
    """Open a file of messages; raises ValueError, which names it, for what cannot be read."""
    if path.is_dir() and not (path / 'metadata.yaml').is_file():
        several = sorted(one for one in path.iterdir() if one.suffix in ('.mcap', '.db3'))
        if len(several) > 1:
            raise ValueError(f'{path} holds {len(several)} files without a metadata.yaml that says'
                             ' how they follow each other; name one of them, or have '
                             '`ros2 bag reindex` write it')
        path = several[0]
    opener = {'.mcap': _mcap, '.db3': _sqlite}.get(path.suffix.lower(), _bag)
    with opener(path) as file:
        yield file


class _Bag:
    def __init__(self, reader: Any) -> None:
        self._reader = reader
        self.topics = {topic: info.msgtype or '' for topic, info in reader.topics.items()}
        self.count = int(reader.message_count)

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        chosen = [one for one in self._reader.connections if one.topic in topics]
        for connection, received, raw in self._reader.messages(chosen):
            content = self._reader.deserialize(raw, connection.msgtype)
            yield Message(connection.topic, connection.msgtype, received, content)


@contextmanager
def _bag(path: Path) -> Iterator[_Bag]:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import get_typestore, Stores

    store = Stores.ROS1_NOETIC if path.suffix == '.bag' else Stores.ROS2_JAZZY
    try:
        with AnyReader([path], default_typestore=get_typestore(store)) as reader:
            yield _Bag(reader)
    except (ValueError, OSError):
        raise
    except Exception as error:  # AnyReaderError, and of a damaged file what the libraries say
        raise ValueError(f'{path} cannot be read as a rosbag2: '
                         f'{error or type(error).__name__}') from None


class _Mcap:
    def __init__(self, path: Path, reader: Any) -> None:
        self._path, self._reader = path, reader
        summary = reader.get_summary()
        if summary is None:
            raise ValueError(f'{path} has no summary: its writer was killed; `mcap recover` '
                             'mends it')
        self._schemas, self._channels = summary.schemas, summary.channels
        self.count = summary.statistics.message_count if summary.statistics else 0
        self.topics = {one.topic: self._schema_name(one.schema_id)
                       for one in summary.channels.values()}
        self._decoders: dict[int, Callable[[bytes], Any]] = {}

    def _schema_name(self, number: int) -> str:
        return self._schemas[number].name if number in self._schemas else ''

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        for schema, channel, message in self._records(topics):
            if channel.id not in self._decoders:
                self._decoders[channel.id] = self._decoder(schema, channel)
            try:
                content = self._decoders[channel.id](message.data)
            except Exception as problem:  # each encoding has an error of its own
                raise ValueError(f'{self._path}: a message on {channel.topic} is no '
                                 f'{channel.message_encoding}: {problem}') from None
            yield Message(channel.topic, schema.name if schema else '', message.log_time, content)

    def _records(self, topics: Collection[str]) -> Iterator[tuple[Any, Any, Any]]:
        records = self._reader.iter_messages(topics=list(topics))
        while True:
            try:
                record = next(records)
            except StopIteration:
                return
            except Exception as problem:  # each decompressor has an error of its own
                raise ValueError(f'{self._path} is damaged: {problem}; `mcap recover` may mend '
                                 'it') from None
            yield record

    def _decoder(self, schema: Any, channel: Any) -> Callable[[bytes], Any]:
        encoding = channel.message_encoding
        if encoding == 'json':
            import json
            return json.loads
        if encoding == 'protobuf':
            try:
                from mcap_protobuf.decoder import DecoderFactory
            except ImportError:
                raise ValueError(f'{self._path}: {channel.topic} holds protobuf messages; reading '
                                 'them needs `pip install mcap-protobuf-support`') from None
            decode = DecoderFactory().decoder_for(encoding, schema)
            if decode is not None:
                return decode
        if encoding == 'cdr' and schema is not None:
            return cdr_decoder(schema.name, schema.encoding, schema.data.decode())
        raise ValueError(f'{self._path}: {channel.topic} is encoded as {encoding!r}; known are '
                         "['cdr', 'json', 'protobuf']")


class _Sqlite:
    def __init__(self, file: SqliteFile) -> None:
        self._file, self.topics, self.count = file, file.topics, file.count

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        for row in self._file.rows(topics):
            yield Message(*row)


@contextmanager
def _sqlite(path: Path) -> Iterator[_Sqlite]:
    with opened_sqlite(path) as file:
        yield _Sqlite(file)


@contextmanager
def _mcap(path: Path) -> Iterator[_Mcap]:
    from mcap.exceptions import McapError
    from mcap.reader import make_reader

    with path.open('rb') as stream:
        try:
            yield _Mcap(path, make_reader(stream))
        except (McapError, EOFError, StructError, UnicodeDecodeError) as error:
            raise ValueError(f'{path} cannot be read as MCAP: {error}; `mcap recover` may mend '
                             'it') from None
