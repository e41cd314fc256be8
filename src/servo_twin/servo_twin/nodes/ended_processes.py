"""Whether what is in the graph is of a process that has ended: DDS keeps a killed one for 20 s."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

FAST_DDS = b'\x01\x0f'


def ended(gid: Sequence[int], own: Sequence[int]) -> bool:
    """
    Tell whether an endpoint is of a process of this machine that is not there any more.

    ``gid`` and ``own`` are identifiers of endpoints; the latter is one of this process. Fast DDS
    begins each with its vendor (2 bytes), the host (2) and the lower half of the process id (2,
    the least first). False where that cannot be known, such as for another machine.
    """
    theirs, ours = bytes(gid[:6]), bytes(own[:6])
    if ours[:2] != FAST_DDS or theirs[:4] != ours[:4]:
        return False
    number = int.from_bytes(theirs[4:], 'little')
    try:
        there = [int(one.name) for one in Path('/proc').iterdir() if one.name.isdigit()]
    except OSError:
        return False
    return not any(_lives(pid) for pid in there if pid & 0xFFFF == number)


def _lives(pid: int) -> bool:
    """Tell whether a process runs; one that nobody has waited for does not (Linux)."""
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
    except OSError:
        return False
