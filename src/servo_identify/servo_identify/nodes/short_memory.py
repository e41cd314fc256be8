"""What a node does that gets no more memory: it says so in a sentence, and goes on."""

from __future__ import annotations

from collections.abc import Callable
import os
import sys
import threading
from time import monotonic, sleep
from typing import Any

from servo_twin.nodes.ending import Ending

SAID = 'memory is short: what needed it was left out'
RECENT = 10.0  # s for which a shortage counts as one of now
WAIT, PATIENCE = 0.05, 60.0  # s between two tries of ROS itself, and until it is given up
_WORDS = ('alloc', 'memory', "can't start new thread")
_LINE = f'identify_node: {SAID}\n'.encode()


def is_shortage(problem: BaseException) -> bool:
    """Return whether an error says that there was no memory; ROS and threads say it in words."""
    return isinstance(problem, MemoryError) or (
        isinstance(problem, RuntimeError) and any(word in str(problem) for word in _WORDS))


class Shortage:
    """
    Counts shortages of one node: ``times``, and :attr:`now`, whether one was lately.

    Errors of memory that no code catches, such as those of threads, end in a sentence as well.
    """

    def __init__(self) -> None:
        self.times = 0
        self._last = -RECENT
        sys.excepthook = self._uncaught(sys.excepthook)
        threading.excepthook = self._uncaught(threading.excepthook)
        sys.unraisablehook = self._uncaught(sys.unraisablehook)

    @property
    def now(self) -> bool:
        """Whether memory was short within the last RECENT seconds."""
        return monotonic() - self._last < RECENT

    def happened(self) -> None:
        """Count a shortage, and write a line where there was none lately; takes no memory."""
        lately = self.now
        self.times += 1
        self._last = monotonic()
        if not lately:
            os.write(2, _LINE)  # a logger of ROS reads source files first

    def guarded(self, callback: Callable[..., Any], begin_again: Callable[[], None] | None = None
                ) -> Callable[..., Any]:
        """
        Return a callback that never raises for want of memory.

        ``begin_again`` drops what the work may have left half done. A service answers with what
        it was given to fill.
        """
        def call(*given: Any) -> Any:
            try:
                return callback(*given)
            except Exception as problem:
                if not is_shortage(problem):
                    raise
            self.happened()
            if begin_again is not None:
                begin_again()
            return given[1] if len(given) > 1 else None

        return call

    def spin(self, ending: Ending, executor: Any, over: Any = None) -> int:
        """
        Spin until the process is to end; 0, or 1 where ROS gets no memory for a long time.

        1 as well once the future ``over`` is done, which holds a sentence. ROS takes memory for
        each message before any callback hears of it.
        """
        since = monotonic()
        while True:
            try:
                ending.spin(executor, over)
                if over is not None and over.done():
                    print(f'identify_node: {over.result()}', file=sys.stderr)
                    return 1
                return 0
            except Exception as problem:
                if not is_shortage(problem):
                    raise
            if not self.now:
                since = monotonic()
            self.happened()
            if monotonic() - since > PATIENCE:
                os.write(2, b'identify_node: ended: ROS had no memory for a minute\n')
                return 1
            sleep(WAIT)

    def _uncaught(self, before: Callable[..., Any]) -> Callable[..., Any]:
        def hook(*given: Any) -> None:
            problem = given[1] if len(given) > 1 else given[0].exc_value
            if problem is not None and is_shortage(problem):
                self.happened()
            else:
                before(*given)

        return hook

