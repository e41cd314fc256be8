"""How long a busy machine has kept processes from running: what may take that much longer."""

from __future__ import annotations

from pathlib import Path
from threading import Thread
from time import monotonic, sleep

_STEP = 0.01  # s between two looks
_LOOKS = 10  # after so many, at the processes that are watched
_seen: list[tuple[float, float]] = []  # instant, s that something came late from then on
_watched: dict[int, tuple[float, dict[str, float]]] = {}  # instant of the last look, s by thread


def watch(pid: int) -> None:
    """Count what keeps a process from running too, from now on and until it ends (Linux)."""
    _watched[pid] = monotonic(), _waited(pid)


def held_up_since(instant: float) -> float:
    """
    Return the s that this process could not run since an instant of monotonic().

    Of each process that is watched, what its most delayed thread has waited for a processor
    counts as well: another process may have had to wait for that one.
    """
    return sum(late for begun, late in list(_seen) if begun + late > instant)


def _waited(pid: int) -> dict[str, float]:
    """Return the s that each thread of a process has waited for a processor; empty: it is gone."""
    waited = {}
    try:
        for task in Path(f'/proc/{pid}/task').iterdir():
            waited[task.name] = int((task / 'schedstat').read_text().split()[1]) * 1e-9
    except OSError:  # a thread, or all of them
        pass
    return waited


def _look_at(pid: int) -> None:
    begun, before = _watched[pid]
    now, waited = monotonic(), _waited(pid)
    if not waited:
        del _watched[pid]
        return
    late = max(total - before.get(thread, 0.0) for thread, total in waited.items())
    if late > _STEP:
        _seen.append((begun, late))
    _watched[pid] = now, before | waited


def _look() -> None:
    while True:
        for _ in range(_LOOKS):
            begun = monotonic()
            sleep(_STEP)
            late = monotonic() - begun - _STEP
            if late > _STEP:
                _seen.append((begun, late))
        for pid in list(_watched):
            _look_at(pid)


Thread(target=_look, name='held up', daemon=True).start()
