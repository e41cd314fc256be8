"""Processes that belong together: started in order, watched, and all ended whatever happens."""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path
import signal
import subprocess
from time import monotonic, sleep

from ..nodes.ending import SIGNALS

BEGINS, ENDS = 'diagnosis begins', 'diagnosis ends'
"""What a live view prints when a diagnosis begins, and when it ends with an answer or without."""
_PATIENCE = 5.0  # s that a process gets after each signal
_LAST_LINES = 12


class ProcessError(RuntimeError):
    """A process that ended, or did not get ready, when it had to run."""


@dataclass
class _Child:
    name: str
    process: subprocess.Popen
    log: Path
    may_end: bool
    first: bool


class Processes:
    """
    A context of child processes; their output goes to ``folder``/NAME.log.

    Each is a session of its own, so that Ctrl-C in the terminal reaches only the parent, which
    then ends the children: those that were started as ``first``, then all others at once. Where
    it is killed, each child sees that its parent has gone and ends by itself. They are ended by
    SIGTERM: SIGINT leaves the stack trace of a Python that has not taken its signals yet.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._children: dict[str, _Child] = {}
        folder.mkdir(parents=True, exist_ok=True)

    def start(self, name: str, command: list[str], may_end: bool = False,
              first: bool = False) -> None:
        """
        Start a process.

        ``may_end``: its end is no failure while its status is 0. ``first``: it holds a motor, and
        is ended before others, which may hang.
        """
        log = self.folder / f'{name}.log'
        with log.open('wb') as output:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output,
                                       stderr=subprocess.STDOUT, start_new_session=True,
                                       env=os.environ | {'PYTHONUNBUFFERED': '1',
                                                        'SERVO_PARENT': str(os.getpid())})
        self._children[name] = _Child(name, process, log, may_end, first)

    def check(self) -> None:
        """Raise ProcessError, with its last lines, for a process that should run and does not."""
        for child in self._children.values():
            status = child.process.poll()
            if status is not None and not (child.may_end and status == 0):
                raise ProcessError(f'{child.name} ended with status {status}:\n'
                                   f'{self.tail(child.name)}\n  (all of it: {child.log})')

    def running(self, name: str) -> bool:
        """Whether a process runs."""
        return self._children[name].process.poll() is None

    def said(self, name: str) -> str:
        """Return what a process has printed."""
        return self._children[name].log.read_text('utf8', errors='replace')

    def tail(self, name: str) -> str:
        """Return the last lines of what a process has printed."""
        lines = self.said(name).strip().splitlines()[-_LAST_LINES:]
        return '\n'.join(f'  {line}' for line in lines) or '  (it said nothing)'

    def pids(self) -> dict[str, int]:
        """Return the process ids of those that run."""
        return {name: child.process.pid for name, child in self._children.items()
                if child.process.poll() is None}

    def cpu_seconds(self) -> dict[str, float]:
        """Return the processor time that each running process has taken so far, s (Linux)."""
        taken = {}
        for name, pid in self.pids().items():
            try:
                fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
            except OSError:
                continue
            taken[name] = (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')
        return taken

    def ask(self, name: str) -> None:
        """Ask one process to end, and do not wait for it."""
        self._children[name].process.send_signal(signal.SIGTERM)

    def stop(self, name: str) -> None:
        """End one process: it is asked twice, then killed."""
        child = self._children[name]
        for number in (signal.SIGTERM, signal.SIGTERM, signal.SIGKILL):
            if child.process.poll() is not None:
                return
            child.process.send_signal(number)
            try:
                child.process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                continue

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, *_: object) -> None:
        # a second Ctrl-C, or the terminal that closes, changes nothing any more
        before = {number: signal.signal(number, signal.SIG_IGN) for number in SIGNALS}
        try:
            for first in (True, False):
                children = [one for one in self._children.values() if one.first is first]
                for child in children:
                    child.process.send_signal(signal.SIGTERM)
                for child in children:
                    self.stop(child.name)
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def wait_until(condition, what: str, patience: float, processes: Processes | None = None) -> None:
    """Wait for a condition; raises ProcessError past ``patience`` s or when a process ends."""
    until = monotonic() + patience
    while not condition():
        if processes is not None:
            processes.check()
        if monotonic() > until:
            raise ProcessError(f'{what}: not within {patience:g} s')
        sleep(0.02)
