"""A job in a process of its own: it reports in lines of JSON and may be killed at any time."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
import json
import os
import signal
import subprocess
import sys
from threading import Lock, Thread
from time import monotonic

_WITH_US = 'servo_twin.bringup.ends_with_parent'
_REFUSED = 'refused'
_KEPT = 30  # lines of what a job says that are kept for its failure


class Job:
    """
    Runs a Python module with words; ``seconds`` counts from its start.

    What it prints is either a report, a JSON mapping in one line, or text that is kept for
    people. It runs at a lower priority, so that the graph goes first, and it is killed when the
    process that started it ends.
    """

    def __init__(self, module: str, *words: str) -> None:
        self._begun = monotonic()
        self._lock = Lock()
        self._reports: deque[Mapping] = deque()
        self._said: deque[str] = deque(maxlen=_KEPT)
        self._refused = ''
        self._process = subprocess.Popen(
            ['nice', '-n', '10', sys.executable, '-m', _WITH_US, module, *words],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            errors='replace', start_new_session=True, env=os.environ | {'PYTHONUNBUFFERED': '1'})
        self._reader = Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return monotonic() - self._begun

    @property
    def status(self) -> int | None:
        """Exit status; None while it runs or is still to be read."""
        status = self._process.poll()
        return None if status is None or self._reader.is_alive() else status

    def reports(self) -> list[Mapping]:
        """Return the reports since the last call, oldest first."""
        with self._lock:
            taken, self._reports = list(self._reports), deque()
        return taken

    def last_words(self) -> str:
        """Return why it failed as :func:`refused` told, or the last line that it printed."""
        with self._lock:
            return self._refused or (self._said[-1] if self._said else 'it said nothing')

    def kill(self) -> None:
        """End it and all that it started, now."""
        try:
            os.killpg(self._process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self._process.wait()

    def _read(self) -> None:
        for line in self._process.stdout:
            line = line.strip()
            try:
                report = json.loads(line) if line.startswith('{') else None
            except ValueError:
                report = None
            with self._lock:
                if isinstance(report, dict) and _REFUSED in report:
                    self._refused = str(report[_REFUSED])
                elif isinstance(report, dict):
                    self._reports.append(report)
                elif line:
                    self._said.append(line)


def report(**facts: object) -> None:
    """Report from within a job."""
    print(json.dumps(facts), flush=True)


def refused(problem: Exception) -> int:
    """Tell from within a job why it cannot be done, be it many lines; return the status for it."""
    report(**{_REFUSED: str(problem)})
    return 2
