"""
What a process says does not hold it up, though nobody takes it.

A terminal that was stopped (Ctrl-S), or a pipe that its reader leaves alone, makes who writes
wait. ROS writes its log lines with Python's lock in hand, so that every thread of a node waits.
"""

from __future__ import annotations

import atexit
import os
import select
import stat
from threading import Thread

MOST = 1 << 20  # bytes that wait for who reads; what comes beyond is left out
PIECE = 4096  # bytes that a pipe takes whole once it takes any
LAST_WORDS = 1.0  # s that what waits may take when the process ends


def free_output() -> None:
    """Let nobody who writes to stdout or stderr wait from now on, up to the end of the process."""
    if os.isatty(2):  # ROS looks at what it writes to, which is a pipe from now on
        os.environ.setdefault('RCUTILS_COLORIZED_OUTPUT', '1')
    for number in (1, 2):
        if _may_wait(number):
            _free(number)


def _may_wait(number: int) -> bool:
    try:
        return not stat.S_ISREG(os.fstat(number).st_mode)
    except OSError:  # closed
        return False


def _free(number: int) -> None:
    taker = os.dup(number)
    read, write = os.pipe()
    os.set_blocking(write, False)
    os.dup2(write, number)
    os.close(write)
    thread = Thread(target=_pass_on, args=(read, taker), name='output', daemon=True)
    thread.start()

    def end() -> None:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, number)  # by which the pipe ends
        thread.join(LAST_WORDS)
        if not thread.is_alive():
            os.dup2(taker, number)

    atexit.register(end)


def _pass_on(read: int, taker: int) -> None:
    waiting, over = bytearray(), False
    while waiting or not over:
        said, taken, _ = select.select([] if over else [read], [taker] if waiting else [], [])
        if said:
            new = os.read(read, MOST)
            over = not new
            if len(waiting) + len(new) <= MOST:
                waiting += new
        if taken:
            try:
                del waiting[:os.write(taker, waiting[:PIECE])]
            except OSError:  # who read has gone
                waiting.clear()
