"""
Runs cases: the rig records, the recordings become bags, the bags are diagnosed.

Each case has a folder. What is in it is kept, so that an interrupted check goes on where it stood:

    case.json               what the rig was told and what is true
    diagnosis/report.json   what `servo-identify diagnose` answered
    failed.txt              instead of it, where it gave no answer
    baselines.json          what others would have answered
    resolved.json           whether what it proposed told an ambiguous pair apart
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
import json
from os import environ
from pathlib import Path
import shutil
import time
import traceback
from typing import Any

from servo_identify.jobs.cluster import scattered

from .cases import Case
from .fault_tables import config_folder, machines, SPLITS
from .resolution import open_pair, resolve
from .rig_recordings import make_bags


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
    if answered and compared and not (wanted.resolution and open_pair(case, place)):
        return place
    bags = _bags(case, place)
    if not answered:
        _answer(case, bags, place)
    if wanted.resolution and open_pair(case, place):
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
            done: Callable[[Case, float], None] = lambda case, seconds: None) -> dict[str, str]:
    """
    Run cases in processes of this machine, or on a Dask cluster at an address.

    ``workers`` of 0 takes all cores. The folder must be one that all workers of a cluster share.
    ``done`` is called with each case as it ends and the seconds it took. Returns why, by the name
    of the case, for those that were lost (a worker died): they have no answer and are asked again
    by the next run.
    """
    by_name, lost = {case.name: case for case in cases}, {}
    environ.setdefault('OMP_NUM_THREADS', '1')
    environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    tasks = {case.name: (case, folder.resolve(), wanted) for case in cases}
    for ended in scattered(run_case, tasks, address=cluster, workers=workers):
        if ended.problem:
            lost[ended.name] = ended.problem
        done(by_name[ended.name], ended.seconds)
    return lost


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
    from servo_identify.cli import main

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
