"""
Runs cases: the rig records, the recordings become bags, the bags are diagnosed.

Each case has a folder. What is in it is kept, so that an interrupted check goes on where it stood:

    case.json               what the rig was told and what is true
    diagnosis/report.json   what `servo-identify diagnose` answered
    failed.txt              instead of it, where it gave no answer
    baselines.json          what others would have answered
    resolved.json           whether the proposed recording told an ambiguous pair apart
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed, ProcessPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
import json
from multiprocessing import get_context
from os import cpu_count, environ
from pathlib import Path
import shutil
import time
import traceback
from typing import Any

from .cases import Case
from .definitions import config_folder, machines, SPLITS
from .rig import make_bags


@dataclass(frozen=True)
class Wanted:
    """What is done of a case beside the diagnosis; ``keep`` leaves its bags where they are."""

    baselines: bool = True
    resolution: bool = False
    keep: bool = False


def run_case(case: Case, folder: Path, wanted: Wanted) -> Path:
    """
    Do what is left to do of a case and return its folder.

    A diagnosis that fails leaves failed.txt with its last words.
    """
    place = folder / case.name
    place.mkdir(parents=True, exist_ok=True)
    (place / 'case.json').write_text(json.dumps(case.as_json(), indent=1) + '\n')
    answered = (place / 'diagnosis' / 'report.json').is_file() or (place / 'failed.txt').is_file()
    compared = (place / 'baselines.json').is_file() or not wanted.baselines
    if answered and compared and not wanted.resolution:
        return place
    bags = _bags(case, place)
    if not answered:
        _answer(case, bags, place)
    if wanted.resolution and not (place / 'failed.txt').is_file():
        from .resolution import resolve
        resolve(case, bags, place, lambda more, where: _diagnose(case, more, where)[0])
    if not compared:
        from .baselines import compare
        answers = compare(machines()[case.machine].servo_path, bags)
        (place / 'baselines.json').write_text(json.dumps(answers, indent=1) + '\n')
    if not wanted.keep:
        shutil.rmtree(place / 'bags')
        shutil.rmtree(place / 'tables', ignore_errors=True)
    return place


def forget(case: Case, folder: Path) -> None:
    """Remove the answer of the diagnosis to a case, so that it is asked again."""
    for name in ('diagnosis', 'proposed', 'random'):
        shutil.rmtree(folder / case.name / name, ignore_errors=True)
    for name in ('failed.txt', 'resolved.json'):
        (folder / case.name / name).unlink(missing_ok=True)


def run_all(cases: list[Case], folder: Path, *, workers: int = 0, cluster: str = '',
            wanted: Wanted = Wanted(),
            done: Callable[[Case, float], None] = lambda case, seconds: None) -> None:
    """
    Run cases in processes of this machine, or on a Dask cluster at an address.

    ``workers`` of 0 takes all cores. The folder must be one that all workers of a cluster share.
    ``done`` is called with each case as it ends and the seconds it took.
    """
    by_name = {case.name: case for case in cases}
    for name, seconds in (_on_cluster if cluster else _on_cores)(
            cases, folder, wanted, cluster or workers or cpu_count()):
        done(by_name[name], seconds)


def _on_cores(cases, folder, wanted, workers) -> Iterator[tuple[str, float]]:
    environ.setdefault('OMP_NUM_THREADS', '1')
    environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    if workers == 1 or len(cases) == 1:
        for case in cases:
            yield _timed(case, folder, wanted)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context('spawn')) as pool:
        running = [pool.submit(_timed, case, folder, wanted) for case in cases]
        try:
            for one in as_completed(running):
                yield one.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _on_cluster(cases, folder, wanted, address) -> Iterator[tuple[str, float]]:
    try:
        from distributed import as_completed as completed
        from distributed import Client
    except ImportError:
        raise ValueError(f'--cluster {address} needs the package distributed, which is not '
                         'installed: pip install distributed') from None
    with Client(address) as client:
        running = [client.submit(_timed, case, folder.resolve(), wanted, pure=False)
                   for case in cases]
        for one in completed(running):
            yield one.result()


def _timed(case: Case, folder: Path, wanted: Wanted) -> tuple[str, float]:
    began = time.perf_counter()
    run_case(case, folder, wanted)
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


def _answer(case: Case, bags: dict[str, list[Path]], place: Path) -> None:
    report, status, said = _diagnose(case, bags, place / 'diagnosis')
    if report is None:
        (place / 'failed.txt').write_text(f'status {status}\n{said}')


def _diagnose(case: Case, bags: Mapping[str, Sequence[Path]], output: Path
              ) -> tuple[dict[str, Any] | None, Any, str]:
    """Ask `servo-identify diagnose`: the report (None without), exit status, what it said."""
    from ..cli import main

    command = ['diagnose', *map(str, bags['screen']),
               '--servo', str(machines()[case.machine].servo_path),
               '--accept', *map(str, bags['accept']), '--report', *map(str, bags['report']),
               '-o', str(output), '--no-page']
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
    output.mkdir(exist_ok=True)
    (output / 'said.txt').write_text(said.getvalue())
    (output / 'seconds.json').write_text(f'{time.perf_counter() - began:.3f}\n')
    report = output / 'report.json'
    return (json.loads(report.read_text()) if report.is_file() else None), status, said.getvalue()
