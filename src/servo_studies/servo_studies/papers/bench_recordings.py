"""
The recordings of the result: what each is for, made once by the emulated bench and kept.

Training and test recordings share neither set-points nor noise: the open-loop runs that are
trained on have other amplitudes and frequencies than the sixteen of table 4.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
import hashlib
import json
from math import radians
from pathlib import Path
import shutil

import numpy as np

from servo_identify.experiment import setpoint_profiles
from servo_identify.experiment.offline_bench import make
from servo_identify.experiment.procedures import Choices, PROCEDURES, Run
from servo_twin.bag import read_recording
from servo_twin.description.shipped import servo_at, shipped
from servo_twin.recording.recording import Recording

SERVO, RIG = 'rv_bench', 'rigs/rv_bench.yaml'
PERIOD = 1e-3
SPEEDS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.4, 1.8, 2.4)
"""rad/s at the load, of the friction experiment: up to what the open-loop runs reach."""

LOADS = (0.0, 15.0, 30.0, 45.0, 60.0)  # N m
LOADED_SPEED = radians(20.0)
TRAINED = Choices(amplitudes=(1.45, 1.65, 1.9), frequencies=(0.7, 1.3))
"""The open-loop runs for training; those of table 4 are 1.5 to 1.8 V at 1 and 0.5 Hz."""

Told = Callable[[str, int, int], None]
"""Is given what is done, how many of it are ready, and how many there are."""


@dataclass(frozen=True)
class Part:
    """Recordings that serve one purpose; ``trains`` says whether models may learn from them."""

    name: str
    trains: bool
    runs: tuple[Run, ...]
    seed: int


def _resisted() -> list[Run]:
    """
    Return turns both ways under loads that resist either way.

    The load turns round with the motion, so that teeth change flanks within a recording and the
    zeros of two recordings need not agree.
    """
    speed = setpoint_profiles.there_and_back(LOADED_SPEED, 2.0 * np.pi, PERIOD)
    half = len(speed) // 2
    runs = []
    for torque in LOADS:
        external = np.concatenate([setpoint_profiles.loaded(torque, half, PERIOD),
                                   -setpoint_profiles.loaded(torque, len(speed) - half, PERIOD)])
        runs.append(Run(f'resisted_{torque:g}', 'backlash', 'velocity', PERIOD, speed, external))
    return runs


def plan() -> tuple[Part, ...]:
    """Return all recordings of the result."""
    def of(procedure: str, choices: Choices) -> list[Run]:
        return PROCEDURES[procedure].runs(choices)

    plain = Choices(period=PERIOD)
    return (
        Part('friction', True, tuple(of('friction', Choices(PERIOD, speeds=SPEEDS))), 100),
        Part('loads', True, tuple(_resisted()), 200),
        Part('transmission_error', True, tuple(of('transmission_error', plain)), 300),
        Part('open_loop_training', True, tuple(
            run for shape in ('sine', 'square') for run in of(f'open_loop_{shape}', TRAINED)),
            400),
        Part('open_loop_test', False, tuple(
            run for shape in ('sine', 'square') for run in of(f'open_loop_{shape}', plain)), 500),
        Part('velocity_loop', False, tuple(of('velocity_loop', plain)), 600),
        Part('reversal', False, tuple(of('reversal', plain)), 700),
        Part('position_ramp', False, tuple(of('position_ramp', plain)), 800))


def recorded(folder: Path, told: Told | None = None, parts: Sequence[Part] | None = None,
             servo: str = SERVO, rig: str = RIG, turned: Sequence[str] = ()
             ) -> Mapping[str, list[Recording]]:
    """
    Return the recordings of each part, making those that ``folder`` does not hold yet.

    ``servo`` and ``rig`` name shipped files, ``turned`` properties of the rig such as
    friction.level=1.5. A bag is regenerated when its set-points, its seed, the rig file or these
    have changed since.
    """
    parts = plan() if parts is None else tuple(parts)
    played = shipped(rig)
    jobs = [(part, run, part.seed + k) for part in parts for k, run in enumerate(part.runs)]
    ready = 0

    def one(job: tuple[Part, Run, int]) -> Recording:
        part, run, seed = job
        return _recorded(folder / part.name, run, seed, played, servo, turned)

    found: dict[str, list[Recording]] = {part.name: [] for part in parts}
    # the longest first, or one core ends the work alone
    order = sorted(range(len(jobs)), key=lambda i: -jobs[i][1].duration)
    with ThreadPoolExecutor(2) as workers:
        futures = {i: workers.submit(one, jobs[i]) for i in order}
        try:
            for i, (part, run, _) in enumerate(jobs):
                found[part.name].append(futures[i].result())
                ready += 1
                if told:
                    told(run.name, ready, len(jobs))
        finally:
            workers.shutdown(cancel_futures=True)
    return found


def _recorded(folder: Path, run: Run, seed: int, rig: Path, servo: str,
              turned: Sequence[str]) -> Recording:
    bag, note = folder / run.name, folder / f'{run.name}.json'
    mark = _mark(run, seed, rig)
    if turned:
        mark['turned'] = ' '.join(turned)
    if not (bag.exists() and note.exists() and json.loads(note.read_text()) == mark):
        shutil.rmtree(bag, ignore_errors=True)
        note.unlink(missing_ok=True)
        folder.mkdir(parents=True, exist_ok=True)
        make(run, folder, rig, servo, servo_at(servo).read_text(), turned, seed=seed)
        note.write_text(json.dumps(mark))
    return read_recording(bag)


def _mark(run: Run, seed: int, rig: Path) -> dict[str, str | int]:
    points = hashlib.sha256(np.concatenate([run.reference, run.external_torque]).tobytes())
    return {'set_points': points.hexdigest(), 'mode': run.mode, 'seed': seed,
            'rig': hashlib.sha256(rig.read_bytes()).hexdigest()}
