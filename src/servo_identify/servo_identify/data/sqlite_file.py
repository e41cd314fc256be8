"""A sqlite3 file of a rosbag2 without the metadata.yaml that belongs beside it."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
import sqlite3
from typing import Any

from .ros_decoder import cdr_decoder


class SqliteFile:
    """An open file: topics with their types, and rows of (topic, kind, received ns, message)."""

    def __init__(self, path: Path, database: sqlite3.Connection) -> None:
        self._path, self._database = path, database
        rows = database.execute('SELECT id, name, type FROM topics').fetchall()
        self._topics = {number: (name, kind) for number, name, kind in rows}
        self.topics = {name: kind for _, name, kind in rows}
        self.count = int(database.execute('SELECT count(*) FROM messages').fetchone()[0])
        try:  # since Jazzy's predecessor Iron
            self._definitions = {kind: (encoding, text) for kind, encoding, text in
                                 database.execute('SELECT topic_type, encoding, '
                                                  'encoded_message_definition '
                                                  'FROM message_definitions')}
        except sqlite3.DatabaseError:
            self._definitions = {}

    def rows(self, topics: Collection[str]) -> Iterator[tuple[str, str, int, Any]]:
        """Yield the messages of topics in the order of their receipt."""
        chosen = {number: (name, kind, cdr_decoder(kind, *self._definitions.get(kind, ('', ''))))
                  for number, (name, kind) in self._topics.items() if name in topics}
        marks = ','.join('?' * len(chosen))
        found = self._database.execute(
            'SELECT topic_id, timestamp, data FROM messages '  # noqa: S608  (question marks)
            f'WHERE topic_id IN ({marks}) ORDER BY timestamp, id', list(chosen))
        try:
            for number, received, raw in found:
                name, kind, decode = chosen[number]
                yield name, kind, received, decode(raw)
        except sqlite3.DatabaseError as problem:
            raise ValueError(f'{self._path} is damaged: {problem}') from None


@contextmanager
def opened_sqlite(path: Path) -> Iterator[SqliteFile]:
    """Open a file, read only; raises ValueError for one that is no rosbag2."""
    try:
        with closing(sqlite3.connect(f'{path.resolve().as_uri()}?mode=ro', uri=True)) as database:
            yield SqliteFile(path, database)
    except sqlite3.Error as problem:
        raise ValueError(f'{path} cannot be read as a rosbag2: {problem}') from None
