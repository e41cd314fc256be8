"""Tasks for a cluster; workers import this file, so it imports next to nothing."""

import os
from pathlib import Path
import signal

import psutil


def told(number: int, folder: Path) -> int:
    """Square a number; 3 kills its worker always, 4 the first time, 5 is refused."""
    mark = folder / f'{number}.tried'
    once = mark.exists()
    mark.touch()
    if number == 3 or (number == 4 and not once):
        os.kill(os.getpid(), signal.SIGKILL)
    if number == 5:
        raise ValueError('five is refused')
    return number**2


def listening() -> list[str]:
    """Return the addresses on which this process listens."""
    return [c.laddr.ip for c in psutil.Process().net_connections('inet')
            if c.status == psutil.CONN_LISTEN]
