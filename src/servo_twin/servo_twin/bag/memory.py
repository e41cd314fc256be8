"""Whether a bag can be read into the memory that there is: said before, not found out."""

from __future__ import annotations

from pathlib import Path

from .bag_writing import BagError
from .mcap_reading import Scan

TAKES = 2.5  # bytes of memory a byte of messages: columns, what they are joined of, one chunk
_LARGEST_RATIO = 1000  # of a chunk's size to its compressed one: a larger one is a damaged head


def free_memory() -> float:
    """Return the bytes of memory that are free for use, inf where the system does not say."""
    try:
        lines = Path('/proc/meminfo').read_text().splitlines()
    except OSError:
        return float('inf')
    told = dict(line.split(':', 1) for line in lines)
    return 1024.0 * float(told['MemAvailable'].split()[0])


def check_fits(path: Path, scans: list[Scan]) -> None:
    """
    Raise BagError for a bag that takes more memory than is free.

    A recording is read whole, 0.8 GB an hour at 1 kHz (tests/benchmarks/bench_limits.py).
    """
    plain = sum(chunk.plain_size for scan in scans for chunk in scan.chunks
                if chunk.plain_size <= _LARGEST_RATIO * max(1, chunk.size))
    needed, free = TAKES * plain, free_memory()
    if needed > free:
        raise BagError(f'{path}: reading it takes about {needed / 2**30:.1f} GiB of memory and '
                       f'{free / 2**30:.1f} GiB are free; record in parts (each start of the '
                       f'recorder makes a bag), or use a larger machine')
