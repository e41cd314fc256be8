"""The diagnosis of the last minute, in a process of its own: how far it is, and its answer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
import json
import os
from pathlib import Path
import signal
import sys
from typing import Any

from ..bag import write_recording
from ..recording.recording import Recording

_LAST = 3  # lines of what it said that tell why it failed
_WATCHED = 'servo_twin.bringup.ends_with_parent'
_JOB = 'servo_identify.jobs.live.diagnose_job'
"""Another package, known here by its command alone, as a person would start it."""


class Diagnosis:
    """
    One diagnosis at a time; the answers lie in ``folder``/N.

    ``began`` and ``ended`` are called when one does; the latter with the answer or the problem.
    ``facts`` is what the page tells: running, stage, progress (0 to 1), sentence, problem, and
    number, which is that of the answer's page once there is one.
    """

    def __init__(self, folder: Path, began: Callable[[], None] = lambda: None,
                 ended: Callable[[str], None] = lambda said: None) -> None:
        self.folder = folder
        self._began, self._ended = began, ended
        self.facts: dict[str, Any] = _facts()
        self._number = 0
        self._task: asyncio.Task | None = None
        self._process: asyncio.subprocess.Process | None = None

    def begin(self, take: Callable[[], Recording]) -> None:
        """Begin with what ``take`` returns, which is called on a thread; one at a time."""
        if self._task is None or self._task.done():
            self._number += 1
            self.facts = _facts(running=True, stage='taking the samples')
            self._task = asyncio.create_task(self._run(take, self._number))

    def cancel(self) -> None:
        """End what runs, now."""
        if self._process is not None:
            _end(self._process)
        if self._task is not None:
            self._task.cancel()

    async def close(self, why: str) -> None:
        """End what runs and wait for it; ``why`` is the problem that the page then tells."""
        ran = self.facts['running']
        self.cancel()
        if self._task is not None:
            await asyncio.gather(self._task, return_exceptions=True)
        if ran:
            self.facts = _facts(problem=why)

    def page(self, number: int) -> Path | None:
        """Return the page of an answer, if there is one."""
        path = self.folder / str(number) / 'answer' / 'report.html'
        return path if path.is_file() else None

    async def _run(self, take: Callable[[], Recording], number: int) -> None:
        self._began()
        try:
            sentence = await self._answer(take, self.folder / str(number))
            self.facts = _facts(sentence=sentence, number=number, progress=1.0)
        except asyncio.CancelledError:
            self.facts = _facts(problem='cancelled')
            raise
        except (ValueError, OSError) as problem:
            self.facts = _facts(problem=str(problem))
        except Exception as problem:  # whatever it is, the page must not wait for ever
            self.facts = _facts(
                problem=f'the diagnosis failed: {type(problem).__name__}: {problem}')
        finally:
            self._process = None
            self._ended(self.facts['sentence'] or self.facts['problem'])

    async def _answer(self, take: Callable[[], Recording], folder: Path) -> str:
        bag = await asyncio.to_thread(_written, take, folder)
        # at a lower priority, so that rig and twin go first, and dead with whoever started it
        self._process = await asyncio.create_subprocess_exec(
            'nice', '-n', '10', sys.executable, '-m', _WATCHED, _JOB,
            str(folder / 'servo.yaml'), str(folder / 'answer'), str(bag),
            stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT, start_new_session=True,
            env=os.environ | {'PYTHONUNBUFFERED': '1'})
        said: list[str] = []
        try:
            async for line in self._process.stdout:
                self._hear(line.decode(errors='replace').strip(), said)
            status = await self._process.wait()
        finally:
            _end(self._process)
        if status < 0:
            raise ValueError(f'the diagnosis was ended by {signal.Signals(-status).name}: is '
                             'there memory enough?')
        if status:
            raise ValueError('; '.join(said[-1:]) or f'the diagnosis ended with status {status}')
        report = json.loads((folder / 'answer' / 'report.json').read_text())
        return report['verdict']['sentence']

    def _hear(self, line: str, said: list[str]) -> None:
        try:
            told = json.loads(line) if line.startswith('{') else None
        except ValueError:
            told = None
        if isinstance(told, dict):
            self.facts = _facts(running=True, stage=str(told.get('stage', '')),
                                progress=float(told.get('progress', 0.0)))
        elif line:
            said.append(line)
            del said[:-_LAST]


def _written(take: Callable[[], Recording], folder: Path) -> Path:
    """Write what ``take`` returns as a bag, and the servo file beside it."""
    recording = take()
    folder.mkdir(parents=True)
    (folder / 'servo.yaml').write_text(recording.servo_file)
    return write_recording(folder / 'last_minute', recording)


def _facts(**given: Any) -> dict[str, Any]:
    return {'running': False, 'stage': '', 'progress': 0.0, 'sentence': '', 'problem': '',
            'number': 0} | given


def _end(process: asyncio.subprocess.Process) -> None:
    """Kill a process and all that it started."""
    if process.returncode is None:
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
