"""Tries spoilt inputs on one target in a process that may die, hang or swell without harm."""

from __future__ import annotations

from contextlib import chdir
from dataclasses import dataclass, field
import hashlib
from pathlib import Path
from random import Random
import resource
import signal
from time import monotonic, process_time
import traceback

from mutation import spoilt
from target import SAID, Target

SECONDS, HANGS = 5.0, 60.0  # s of processor time, and of any, that one input may take
MEMORY = 3 << 30  # bytes of address space beyond what the process had at the start


class TooLong(BaseException):
    """An input took longer than it may; no handler of the code under test catches it."""


@dataclass
class Trials:
    """What came of the inputs of one target: counts and the findings by where they come from."""

    answered: int = 0
    refused: int = 0
    findings: dict[str, tuple[bytes, str]] = field(default_factory=dict)
    slowest: float = 0.0

    @property
    def inputs(self) -> int:
        """How many inputs there were."""
        return self.answered + self.refused + len(self.findings)


def limit_memory() -> None:
    """Let this process take at most MEMORY more than it has."""
    pages = int(Path('/proc/self/statm').read_text().split()[0])
    most = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


def judge(target: Target, content: bytes, folder: Path) -> tuple[str, str]:
    """Return ('answered' | 'refused' | 'finding', what it said or where it broke)."""
    before, begin = set(folder.parent.iterdir()), monotonic()
    outcome = _outcome(target, content, folder)
    if outcome[0] != 'finding' and monotonic() - begin > SECONDS:  # or was the machine busy?
        begin = process_time()
        outcome = _outcome(target, content, folder)
        if process_time() - begin > SECONDS:
            outcome = 'finding', f'slow: {process_time() - begin:.1f} s of processor time'
    strange = [path for path in set(folder.parent.iterdir()) - before if path != folder]
    if strange:
        outcome = 'finding', f'made {strange[0].name} outside of its folder'
    return outcome


def _outcome(target: Target, content: bytes, folder: Path) -> tuple[str, str]:
    def late(*_: object) -> None:
        raise TooLong
    signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, HANGS)
    try:
        with chdir(folder):
            target.take(content, folder)
        return 'answered', ''
    except SAID as said:
        return ('refused', str(said)) if str(said).strip() else ('finding', 'says nothing')
    except TooLong:
        return 'finding', f'hangs: more than {HANGS:g} s'
    except BaseException as problem:
        last = traceback.extract_tb(problem.__traceback__)[-1]
        ours = [frame for frame in traceback.extract_tb(problem.__traceback__)
                if 'servo_' in frame.filename]
        at = ours[-1] if ours else last
        return 'finding', (f'{type(problem).__name__} at {Path(at.filename).name}:{at.lineno}: '
                           f'{str(problem)[:200]}')
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def tried(target: Target, seed: str, folder: Path, seconds: float, most: int = 10**9,
          before=lambda content: None, ready=lambda: None) -> Trials:
    """Spoil the seeds of a target for some seconds, or ``most`` times; findings once each."""
    folder.mkdir(parents=True, exist_ok=True)
    random, trials = Random(seed), Trials()
    seeds = target.seeds(folder)
    ready()
    until = monotonic() + seconds
    while monotonic() < until and trials.inputs < most:
        content = spoilt(random.choice(seeds), random, target.text, seeds)
        before(content)
        begin = monotonic()
        note(trials, content, *judge(target, content, folder), monotonic() - begin)
    return trials


def note(trials: Trials, content: bytes, outcome: str, said: str, seconds: float) -> None:
    """Count what came of an input; one finding of a kind is kept."""
    trials.slowest = max(trials.slowest, seconds)
    kind = said.partition(': ')[0]
    if outcome == 'finding' and kind not in trials.findings:
        trials.findings[kind] = content, said
    elif outcome == 'answered':
        trials.answered += 1
    else:
        trials.refused += 1


def named(content: bytes) -> str:
    """Return a short name for a case."""
    return hashlib.sha256(content).hexdigest()[:12]
