"""
Runs a Python module that ends with the pipe on its standard input.

    python -m servo_twin.bringup.ends_with_parent MODULE WORD...

Whoever starts it keeps the other end of the pipe. When that process ends, however it ends, the
module and all processes of its group are killed. The caller makes it the leader of a group.
"""

from __future__ import annotations

import os
import runpy
import signal
import sys
from threading import Thread


def _watch() -> None:
    while os.read(sys.stdin.fileno(), 1 << 12):
        pass
    os.killpg(0, signal.SIGKILL)


if __name__ == '__main__':
    Thread(target=_watch, daemon=True).start()
    sys.argv = sys.argv[1:]
    runpy.run_module(sys.argv[0], run_name='__main__', alter_sys=True)
