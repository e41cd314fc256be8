"""
How a process ends: by SIGINT, SIGTERM, SIGHUP (a closed terminal) or SIGTSTP, or after its parent.

One signal is enough; a launch and a terminal send two or three, and the further ones must not cut
off what the first one began, such as taking a drive down. Ctrl-Z (SIGTSTP) ends it as well: who
stands still looks after no motor, and who goes on later begins in the middle of a motion.
"""

from __future__ import annotations

import atexit
from collections.abc import Callable
import os
import signal
from threading import Thread
from time import sleep
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP)
LOOKS = 0.1  # s between two looks at the parent, and at a signal where nothing else happens
if 'SERVO_PARENT' in os.environ:
    # started by us: until somebody takes the signals, SIGINT ends it as SIGTERM does, in silence
    signal.signal(signal.SIGINT, signal.SIG_DFL)
PARENT = int(os.environ.pop('SERVO_PARENT', os.getppid()))
"""
The process that started this one, which may end at any time: as it said itself where it is ours,
else as of the first import.
"""


class Ending:
    """
    Takes the signals of this process from now on, in its main thread.

    ``asked`` turns true at the first of them, and shortly after the parent has ended; ``then`` is
    called once at that time, within a signal handler. A process that init started, as under a
    service manager, has only its signals.
    """

    def __init__(self, then: Callable[[], None] = lambda: None) -> None:
        self.asked = False
        self.then = then
        for number in SIGNALS:
            signal.signal(number, self._hear)
        atexit.register(_deaf)
        if PARENT != 1:
            Thread(target=self._watch, name='parent watch', daemon=True).start()

    def _hear(self, *_: object) -> None:
        if not self.asked:
            self.asked = True
            self.then()

    def spin(self, executor: Any, over: Any = None) -> None:
        """
        Have a ROS executor spin until the process is to end, or a future is done.

        An executor that always has work to do heeds no time-out; it heeds the future of its turn.
        What was to be called at a signal is called before.
        """
        from rclpy.task import Future

        def stop(*_: object) -> None:
            if not turn.done():
                turn.set_result(None)

        def hear() -> None:
            before()
            stop()

        turn = Future()
        before, self.then = self.then, hear
        if over is not None:
            over.add_done_callback(stop)
        while not (self.asked or over is not None and over.done()):
            executor.spin_until_future_complete(turn, LOOKS)
            turn = Future()

    @staticmethod
    def _watch() -> None:
        while os.getppid() == PARENT:
            sleep(LOOKS)
        os.kill(os.getpid(), signal.SIGTERM)


def _deaf() -> None:
    """Hear no signal while the interpreter ends: it would put the default handlers back."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
