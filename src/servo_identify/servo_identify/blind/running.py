"""
Runs cases: the rig records, the recordings become bags, the bags are diagnosed.

Each case has a folder. What is in it is kept, so that an interrupted check goes on where it stood:

    case.json               what the rig was told and what is true
    diagnosis/report.json   what `servo-identify diagnose` answered
    failed.txt              instead of it, where it gave no answer
    baselines.json          what others would have answered
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import as_completed, ProcessPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
import json
from multiprocessing import get_context
from os import cpu_count, environ
from pathlib import Path
import shutil
import time
import traceback

from .cases import Case
from .definitions import config_folder, machines, SPLITS
from .rig import make_bags


def run_case(case: Case, folder: Path, keep: bool = False, baselines: bool = True) -> Path:
    """
    Do what is left to do of a case and return its folder.

    ``keep`` leaves the bags there. A diagnosis that fails leaves failed.txt with its last words.
    """
    place = folder / case.name
    place.mkdir(parents=True, exist_ok=True)
    (place / 'case.json').write_text(json.dumps(case.as_json(), indent=1) + '\n')
    answered = (place / 'diagnosis' / 'report.json').is_file() or (place / 'failed.txt').is_file()
    compared = (place / 'baselines.json').is_file() or not baselines
    if answered and compared:
        return place
    bags = _bags(case, place)
    if not answered:
        _diagnose(case, bags, place)
    if not compared:
        from .baselines import compare
        answers = compare(machines()[case.machine].servo_path, bags)
        (place / 'baselines.json').write_text(json.dumps(answers, indent=1) + '\n')
    if not keep:
        shutil.rmtree(place / 'bags')
        shutil.rmtree(place / 'tables', ignore_errors=True)
    return place


def forget(case: Case, folder: Path) -> None:
    """Remove the answer of the diagnosis to a case, so that it is asked again."""
    shutil.rmtree(folder / case.name / 'diagnosis', ignore_errors=True)
    (folder / case.name / 'failed.txt').unlink(missing_ok=True)


def run_all(cases: list[Case], folder: Path, *, workers: int = 0, cluster: str = '',
            keep: bool = False, baselines: bool = True,
            done: Callable[[Case, float], None] = lambda case, seconds: None) -> None:
    """
    Run cases in processes of this machine, or on a Dask cluster at an address.

    ``workers`` of 0 takes all cores. The folder must be one that all workers of a cluster share.
    ``done`` is called with each case as it ends and the seconds it took.
    """
    by_name = {case.name: case for case in cases}
    for name, seconds in (_on_cluster if cluster else _on_cores)(
            cases, folder, keep, baselines, cluster or workers or cpu_count()):
        done(by_name[name], seconds)


def _on_cores(cases, folder, keep, baselines, workers) -> Iterator[tuple[str, float]]:
    environ.setdefault('OMP_NUM_THREADS', '1')
    environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    if workers == 1 or len(cases) == 1:
        for case in cases:
            yield _timed(case, folder, keep, baselines)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context('spawn')) as pool:
        running = [pool.submit(_timed, case, folder, keep, baselines) for case in cases]
        try:
            for one in as_completed(running):
                yield one.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _on_cluster(cases, folder, keep, baselines, address) -> Iterator[tuple[str, float]]:
    try:
        from distributed import as_completed as completed
        from distributed import Client
    except ImportError:
        raise ValueError(f'--cluster {address} needs the package distributed, which is not '
                         'installed: pip install distributed') from None
    with Client(address) as client:
        running = [client.submit(_timed, case, folder.resolve(), keep, baselines, pure=False)
                   for case in cases]
        for one in completed(running):
            yield one.result()


def _timed(case: Case, folder: Path, keep: bool, baselines: bool) -> tuple[str, float]:
    began = time.perf_counter()
    run_case(case, folder, keep, baselines)
    return case.name, time.perf_counter() - began


def _bags(case: Case, place: Path) -> dict[str, list[Path]]:
    machine = machines()[case.machine]
    orders = [{**order, 'rig': str(config_folder() / order['rig'])}
              for split in SPLITS for order in case.recordings[split]]
    bags = make_bags(orders, machine.servo_path, place)
    parts, at = {}, 0
    for split in SPLITS:
        size = len(case.recordings[split])
        parts[split] = bags[at:at + size]
        at += size
    return parts


def _diagnose(case: Case, bags: dict[str, list[Path]], place: Path) -> None:
    from ..cli import main

    command = ['diagnose', *map(str, bags['screen']),
               '--servo', str(machines()[case.machine].servo_path),
               '--accept', *map(str, bags['accept']), '--report', *map(str, bags['report']),
               '-o', str(place / 'diagnosis'), '--no-page']
    if case.without:
        command += ['--without', *case.without]
    said, began = StringIO(), time.perf_counter()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            status = main(command)
    except SystemExit as stop:
        status = stop.code
    except Exception:  # a stack trace is a miss like any other, and the check goes on
        said.write(traceback.format_exc())
        status = 'a stack trace'
    (place / 'diagnosis').mkdir(exist_ok=True)
    (place / 'diagnosis' / 'said.txt').write_text(said.getvalue())
    (place / 'diagnosis' / 'seconds.json').write_text(f'{time.perf_counter() - began:.3f}\n')
    if not (place / 'diagnosis' / 'report.json').is_file():
        (place / 'failed.txt').write_text(f'status {status}\n{said.getvalue()}')
