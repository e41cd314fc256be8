"""What the soak asks of the identify node by turns: a retraining, then a diagnosis."""

from __future__ import annotations

from pathlib import Path
from time import time

from rclpy.action import ActionClient
from rig import Rig

from servo_twin_msgs.action import Diagnose, Retrain

EACH = 600.0  # s from one to the next; a third of a soak that is shorter than half an hour
PATIENCE = 420.0  # s until an answer must have come
BUDGET = 60.0  # s that a retraining may take
HEARD = 30.0  # s that the node must have run: it works on what it has heard
KEPT = 4000  # samples without a hole that it must have: a diagnosis needs 3 s of them
SETTLED = 10.0  # s after an answer, when memory is looked at again
RETURNS = 64.0  # MiB: the node keeps 180 s of samples, some 17 MiB, and writes them once
LEARN = ['effects.coulomb.level', 'drive.gain']
JOBS = 'servo_identify.jobs.live'


class Tasks:
    """
    Asks, waits and notes: ``rows`` holds a dictionary a task.

    ``answer`` is what was said and ``seconds`` after how long; ``cut`` that the node ended
    meanwhile, which takes the answer with it. ``before`` and ``after`` are the memory of the node,
    MiB; ``left`` how many processes of jobs there were after the answer.
    """

    def __init__(self, rig: Rig, length: float) -> None:
        self.rig, self.period = rig, min(EACH, length / 3.0)
        self.rows: list[dict] = []
        self._due = time() + self.period / 2.0
        self._now: dict | None = None
        self._handle = None
        self.held = self._over = False  # whether nothing is asked for now; for ever
        self._runs: tuple[int | None, float] = None, 0.0  # the node, and since when
        self._clients = {'retrain': ActionClient(rig.ears.node, Retrain, 'retrain'),
                         'diagnose': ActionClient(rig.ears.node, Diagnose, 'diagnose')}

    @property
    def busy(self) -> bool:
        """Whether an answer is awaited."""
        return self._now is not None

    def turn(self) -> None:
        """Ask, or look whether an answer has come."""
        now, pid = time(), self.rig.bench.pids().get('identify')
        row = self._now
        if pid != self._runs[0]:
            self._runs = pid, now
        if row is None:
            kept = int(self.rig.ears.facts['identify'].get('samples kept', 0))
            ready = pid is not None and now - self._runs[1] > HEARD and kept > KEPT
            if ready and now >= self._due and not self._over and not self.held:
                self._ask(now, pid)
            return
        if pid != row['pid']:
            row['cut'] = True
        elif 'answer' not in row:
            if now - row['at'] < PATIENCE:
                return
        elif now - row['answered'] < SETTLED:
            return
        if not row.get('cut'):
            row['after'] = _held(pid)
            row['left'] = len(_children(pid))
        self._now = self._handle = None
        self._due = now + 5.0 if row.get('cut') else row['at'] + self.period

    def end(self) -> None:
        """Cancel what still runs: its answer then comes at once."""
        if self._now is not None and self._handle is not None and 'answer' not in self._now:
            self._now['cancelled'] = True
            self._handle.cancel_goal_async()
        self._over = True

    def _ask(self, now: float, pid: int) -> None:
        asked = sum(not row.get('cut') for row in self.rows)
        kind = ('retrain', 'diagnose')[asked % 2]
        client = self._clients[kind]
        if not client.server_is_ready():
            return
        row = {'kind': kind, 'at': now, 'pid': pid, 'before': _held(pid)}
        goal = (Retrain.Goal(learn=LEARN, budget=BUDGET) if kind == 'retrain'
                else Diagnose.Goal())
        self._now = row
        self.rows.append(row)
        client.send_goal_async(goal).add_done_callback(lambda told: self._taken(row, told))

    def _taken(self, row: dict, told) -> None:
        handle = told.result()
        if not handle.accepted:
            self._answered(row, False, 'refused: a job is running')
            return
        if row is self._now:
            self._handle = handle
        handle.get_result_async().add_done_callback(lambda done: self._answered(
            row, done.result().result.success, done.result().result.message))

    @staticmethod
    def _answered(row: dict, success: bool, said: str) -> None:
        row.update(answered=time(), success=success)
        row.update(seconds=row['answered'] - row['at'], answer=said)


def judged(rows: list[dict]) -> list[tuple[str, str, bool | None]]:
    """Return the promises of the tasks: name, what was seen, whether it was kept."""
    if not rows:
        return []
    whole = [row for row in rows if not row.get('cut')]
    answered = [row for row in whole if 'answer' in row]
    done = [row for row in answered if row['success']]
    slowest = max((row['seconds'] for row in answered), default=0.0)
    memory = [row['after'] - row['before'] for row in answered if 'after' in row]
    left = sum(row.get('left', 0) for row in answered)
    each = ', '.join(f'{sum(row["kind"] == kind for row in done)} '
                     f'{"retrainings" if kind == "retrain" else "diagnoses"}'
                     for kind in ('retrain', 'diagnose'))
    return [
        ('each retraining and diagnosis is answered',
         f'{len(answered)} of {len(whole)}, the slowest after {slowest:.0f} s; {each} with '
         f'success; {len(rows) - len(whole)} more ended with the node',
         len(answered) == len(whole) if whole else None),
        (f'their memory returns: the node holds at most {RETURNS:g} MiB more, no job is left',
         f'at most {max(memory):+.1f} MiB of {len(memory)}; {left} processes left'
         if memory else 'none was looked at',
         max(memory) <= RETURNS and not left if memory else None)]


def _held(pid: int) -> float:
    """Return the memory of a process, MiB; 0: it has gone."""
    try:
        told = Path(f'/proc/{pid}/status').read_text()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024.0 for line in told.splitlines()
                 if line.startswith('VmRSS')), 0.0)


def _children(parent: int) -> list[int]:
    """Return the ids of the jobs that a process started and that still run."""
    found = []
    for entry in Path('/proc').iterdir():
        if entry.name.isdigit():
            try:
                stat = (entry / 'stat').read_text().rpartition(')')[2].split()
                words = (entry / 'cmdline').read_bytes().decode(errors='replace')
            except OSError:
                continue
            if int(stat[1]) == parent and JOBS in words and stat[0] != 'Z':
                found.append(int(entry.name))
    return found
