"""
What a process says does not hold it up, though nobody takes it.

A terminal that was stopped (Ctrl-S), or a pipe that its reader leaves alone, makes who writes
wait. ROS writes its log lines with Python's lock in hand, so that every thread of a node waits.
A small process of its own, which runs this file, hands on what a node says. What a node that is
killed or aborts has said last is not lost with it.
"""

from __future__ import annotations

import atexit
from contextlib import suppress
import fcntl
from math import inf
import os
from pathlib import Path
import select
import signal
import stat
import sys
from time import monotonic

MOST = 1 << 20  # bytes that wait for who reads; what comes beyond is left out
PIECE = 4096  # bytes that a pipe takes whole once it takes any
LAST_WORDS = 1.0  # s that what waits may take when the process has ended
OUTPUTS = (1, 2)  # stdout and stderr
_NEVER_WAITS = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY


def free_output() -> None:
    """Let nobody who writes to stdout or stderr wait from now on, up to the end of the process."""
    if os.isatty(2):  # ROS looks at what it writes to, which is a pipe from now on
        os.environ.setdefault('RCUTILS_COLORIZED_OUTPUT', '1')
    waits = [number for number in OUTPUTS if _may_wait(number)]
    if waits == [1, 2] and os.path.sameopenfile(1, 2):  # so that the order of the lines is kept
        _free({1: (1, 2)})
    elif waits:
        _free({number: (number,) for number in waits})


def _may_wait(number: int) -> bool:
    try:
        kind = os.fstat(number)
    except OSError:  # closed
        return False
    return not (stat.S_ISREG(kind.st_mode) or kind.st_rdev == Path(os.devnull).stat().st_rdev)


def _free(outputs: dict[int, tuple[int, ...]]) -> None:
    """Put a pipe before each output of a process; it may go by several numbers."""
    from subprocess import DEVNULL, Popen, TimeoutExpired

    takers = {number: os.dup(number) for number in outputs}
    pipes = {number: os.pipe() for number in outputs}
    ends = [end for number in outputs for end in (pipes[number][0], takers[number])]
    try:
        process = Popen([sys.executable, '-I', '-S', __file__, *map(str, ends)], pass_fds=ends,
                        stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL, start_new_session=True)
    except OSError:  # the machine has no room for it: what is said may wait
        for end in [end for pipe in pipes.values() for end in pipe] + [*takers.values()]:
            os.close(end)
        return
    for number, names in outputs.items():
        read, write = pipes[number]
        os.close(read)
        with suppress(OSError):  # a user may have no more of such room
            fcntl.fcntl(write, fcntl.F_SETPIPE_SZ, MOST)
        os.set_blocking(write, False)
        for name in names:
            os.dup2(write, name)
        os.close(write)

    def end() -> None:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for names in outputs.values():
            for name in names:
                os.dup2(nowhere, name)  # by which the pipe ends
        try:
            process.wait(2.0 * LAST_WORDS)
        except TimeoutExpired:
            return
        for number, names in outputs.items():  # what ROS says as it ends must not wait either
            with suppress(OSError):
                taker = os.open(f'/proc/self/fd/{takers[number]}', _NEVER_WAITS)
                for name in names:
                    os.dup2(taker, name)
                os.close(taker)

    atexit.register(end)


def pass_on(takers: dict[int, int]) -> None:
    """Hand on what comes out of each pipe, up to LAST_WORDS after the last pipe has ended."""
    waiting = {read: bytearray() for read in takers}
    begun, until = set(takers), inf
    while (begun or any(waiting.values())) and monotonic() < until:
        owed = {takers[read]: some for read, some in waiting.items() if some}
        left = None if until == inf else max(0.0, until - monotonic())
        said, taken, _ = select.select(begun, owed, [], left)
        for read in said:
            new = os.read(read, MOST)
            if not new:
                begun.remove(read)
                until = inf if begun else monotonic() + LAST_WORDS
            elif len(waiting[read]) + len(new) <= MOST:
                waiting[read] += new
        for taker in taken:
            try:
                del owed[taker][:os.write(taker, owed[taker][:PIECE])]
            except BlockingIOError:  # another one was faster
                pass
            except OSError:  # who read has gone
                owed[taker].clear()


def _never_waits(taker: int) -> int:
    """Return the same output, opened so that writing to it never waits, where that goes."""
    try:  # not set on the one that is there: others who write to it share that
        return os.open(f'/proc/self/fd/{taker}', _NEVER_WAITS)
    except OSError:
        return taker


if __name__ == '__main__':
    for asked in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP, signal.SIGQUIT):
        signal.signal(asked, signal.SIG_IGN)  # it ends by the end of what it hands on
    numbers = [int(word) for word in sys.argv[1:]]
    pass_on({read: _never_waits(taker)
             for read, taker in zip(numbers[::2], numbers[1::2], strict=True)})
