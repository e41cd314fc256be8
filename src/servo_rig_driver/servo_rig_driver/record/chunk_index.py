"""What a bag's summary says of each chunk, kept in a file: a recording of months holds as much."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryFile

_LENGTH = 4  # bytes before each entry


class ChunkIndex:
    """
    The entries of a bag's chunks, in the place of rosbags' list of buffers.

    A buffer holds some 700 bytes a chunk and a recorder writes two chunks a second, which made
    2 MiB an hour. The file lies in ``folder``, has no name and is gone with the process. Raises
    OSError where the folder is full.
    """

    def __init__(self, folder: Path) -> None:
        self._file = TemporaryFile(dir=folder)  # noqa: SIM115 (as long as the bag)
        self._count = 0

    def append(self, entry: BytesIO) -> None:
        """Take the entry of one more chunk."""
        data = entry.getvalue()
        self._file.write(len(data).to_bytes(_LENGTH, 'little') + data)
        self._count += 1

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[BytesIO]:
        """Give the entries in their order, each as rosbags left it: at its end."""
        self._file.seek(0)
        for _ in range(self._count):
            entry = BytesIO()
            entry.write(self._file.read(int.from_bytes(self._file.read(_LENGTH), 'little')))
            yield entry

    def close(self) -> None:
        """Give the file up."""
        self._file.close()
