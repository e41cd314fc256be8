"""A wall clock that can be set for some processes alone, as NTP or an administrator sets it."""

from __future__ import annotations

from pathlib import Path
from struct import pack
import subprocess

SOURCE = Path(__file__).with_name('stepped_clock.c')


class SteppedClock:
    """
    A clock so far ``ahead``, s, of that of the machine; its steady clock is that of the machine.

    ``environment`` are the variables of a process that goes by it, empty where the library cannot
    be built (``works``): it needs a C compiler.
    """

    def __init__(self, folder: Path) -> None:
        library, self._file = folder / 'stepped_clock.so', folder / 'stepped_clock'
        self.works = subprocess.run(
            ['cc', '-O2', '-shared', '-fPIC', '-o', str(library), str(SOURCE), '-ldl'],
            capture_output=True, check=False).returncode == 0
        self.environment = {'LD_PRELOAD': str(library),
                            'STEPPED_CLOCK': str(self._file)} if self.works else {}
        self._file.touch()
        self.set(0.0)

    def set(self, ahead: float) -> None:
        """Set it, from now on."""
        self.ahead = ahead
        with self._file.open('r+b') as file:  # it is mapped: its length must stay
            file.write(pack('<q', round(ahead * 1e9)))
