"""Whether a bag can be read into the memory that there is: said before, not found out."""

from __future__ import annotations

from pathlib import Path

from .bag_writing import BagError


def free_memory() -> float:
    """Return the bytes of memory that are free for use, inf where the system does not say."""
    try:
        lines = Path('/proc/meminfo').read_text().splitlines()
    except OSError:
        return float('inf')
    told = dict(line.split(':', 1) for line in lines)
    return 1024.0 * float(told['MemAvailable'].split()[0])


def check_fits(path: Path, needed: float, advice: str = 'record in parts (each start of the '
               'recorder makes a bag)') -> None:
    """Raise BagError, with what to do, where reading takes more bytes of memory than are free."""
    free = free_memory()
    if needed > free:
        raise BagError(f'{path}: reading it takes about {needed / 2**30:.1f} GiB of memory and '
                       f'{free / 2**30:.1f} GiB are free; {advice}, or use a larger machine')
