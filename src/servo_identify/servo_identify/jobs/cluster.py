"""
Many tasks on a Dask cluster: one of this machine's own processes, or one at an address.

A task that fails costs itself only, and so does a worker that dies under one. Which of the tasks
of a dead worker killed it cannot be known, so those that it held are run once more at the end, one
at a time: the guilty one is then alone, and the others finish.

A cluster of our own listens on localhost only and shows no dashboard. Workers of a cluster at an
address need this workspace installed, and see the files that tasks name under the same paths.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
import logging
from os import cpu_count
import time
from typing import Any

ANSWERS_WITHIN = '10s'
"""How long a scheduler may take to answer at its address."""

_QUIET = {
    'distributed.scheduler.allowed-failures': 0,  # see above: suspects run again, alone
    'distributed.scheduler.worker-saturation': 1.0,
    'distributed.scheduler.http.routes': [],
    'distributed.worker.http.routes': [],
    'distributed.comm.timeouts.connect': '30s',
    'distributed.nanny.pre-spawn-environ': {'OMP_NUM_THREADS': '1', 'OPENBLAS_NUM_THREADS': '1',
                                            'MKL_NUM_THREADS': '1'},
}

_NO_PAGES = {'dashboard': False, 'dashboard_address': '127.0.0.1:0'}  # Dask always listens here


@dataclass(frozen=True)
class Finished:
    """A task that ended: what it returned, or the ``problem`` it ended by; seconds it took."""

    name: str
    answer: Any = None
    problem: str = ''
    seconds: float = 0.0


def scattered(work: Callable[..., Any], tasks: Mapping[str, tuple], *, address: str = '',
              workers: int = 0) -> Iterator[Finished]:
    """
    Call ``work(*task)`` for each of ``tasks`` (by name) and yield each as it finishes.

    ``work`` is a function of a module, its arguments and answers can be pickled. ``address`` of a
    Dask scheduler; without one, ``workers`` processes of this machine (0: one a core), and no
    process at all where one worker or one task is asked for. Raises ValueError where no scheduler
    answers.
    """
    workers = min(workers or cpu_count() or 1, len(tasks))
    if not address and workers <= 1:
        for name, task in tasks.items():
            yield _finished(name, *_attempted(work, task))
        return
    with _client(address, workers) as client:
        suspects = []
        for done, died in _round(client, work, tasks):
            if died:
                suspects.append(done.name)
            else:
                yield done
        for name in suspects:
            for done, _ in _round(client, work, {name: tasks[name]}):
                yield done


def _round(client: Any, work: Callable[..., Any],
           tasks: Mapping[str, tuple]) -> Iterator[tuple[Finished, bool]]:
    """Run tasks once; yield each as it ends, and whether its worker died."""
    from distributed import as_completed

    running = {client.submit(_attempted, work, task, pure=False): name
               for name, task in tasks.items()}
    for future in as_completed(running):
        name = running.pop(future)
        if future.status == 'finished':
            yield _finished(name, *future.result()), False
        else:
            yield Finished(name, problem=_of_death(future)), True


def _of_death(future: Any) -> str:
    from distributed import KilledWorker

    if isinstance(future.exception() if future.status == 'error' else None, KilledWorker):
        return 'its worker died, and died again when it ran alone'
    if future.status == 'error':
        return f'the cluster could not run it: {future.exception()}'
    return f'the cluster gave it up ({future.status})'


def _attempted(work: Callable[..., Any], task: tuple) -> tuple[Any, str, float]:
    """Return answer, problem and seconds of one call."""
    began = time.perf_counter()
    try:
        return work(*task), '', time.perf_counter() - began
    except Exception as problem:  # whatever it is, it is this task's alone
        said = str(problem.args[0]) if isinstance(problem, KeyError) else str(problem)
        if not isinstance(problem, ValueError | KeyError | OSError):
            said = f'{type(problem).__name__}: {said}'
        return None, said or type(problem).__name__, time.perf_counter() - began


def _finished(name: str, answer: Any, problem: str, seconds: float) -> Finished:
    return Finished(name, answer, problem, seconds)


@contextmanager
def _client(address: str, workers: int) -> Iterator[Any]:
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        raise ValueError('a cluster needs the package distributed, which is not installed: '
                         'pip install distributed') from None
    for name in ('distributed', 'distributed.client'):  # deaths are told by us
        logging.getLogger(name).setLevel(logging.CRITICAL)
    with dask.config.set(_QUIET):
        if not address:
            with (LocalCluster(n_workers=workers, threads_per_worker=1, host='127.0.0.1',
                               dashboard_address=None, scheduler_kwargs=_NO_PAGES,
                               memory_limit=None) as cluster,
                  Client(cluster) as client):
                yield client
            return
        try:
            client = Client(address, timeout=ANSWERS_WITHIN)
        except (OSError, ValueError) as problem:
            raise ValueError(f'no Dask scheduler answers at {address} within {ANSWERS_WITHIN} '
                             f'({problem}); an address is as tcp://HOST:8786') from None
        with client:
            yield client
