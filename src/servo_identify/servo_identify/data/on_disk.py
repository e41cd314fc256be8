"""A long column of numbers in a file, to be read in parts."""

from __future__ import annotations

from array import array
from typing import IO

import numpy as np

_WRITES = 1 << 16  # numbers that are written at once


class OnDisk:
    """A column of numbers of eight bytes in a file."""

    def __init__(self, file: IO[bytes], code: str) -> None:
        self._file, self._code, self._new = file, code, array(code)

    def append(self, number: float) -> None:
        """Take the next number."""
        self._new.append(number)  # type: ignore[arg-type]
        if len(self._new) == _WRITES:
            self._flush()

    def extend(self, numbers: np.ndarray) -> None:
        """Take the next numbers."""
        self._flush()
        numbers.astype(self._code, copy=False).tofile(self._file)

    def part(self, first: int = 0, count: int = -1) -> np.ndarray:
        """Return so many numbers from one on, or all that follow."""
        self._flush()
        self._file.seek(8 * first)
        return np.fromfile(self._file, self._code, count)

    def mapped(self) -> np.ndarray:
        """Return all numbers as an array of pages of the file, which cannot be changed."""
        self._flush()
        return np.asarray(np.memmap(self._file, self._code, 'r'))

    def _flush(self) -> None:
        self._file.seek(0, 2)
        self._new.tofile(self._file)
        self._new = array(self._code)
