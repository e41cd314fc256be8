"""
The recordings of the EMA bench: three purposes that share neither settings nor set-points.

The grid is what is judged. The curve of the backlash and the identification use other settings of
the slide and of the brake, other amplitudes and other frequencies.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
import hashlib
import json
from math import pi
from pathlib import Path
import shutil

import numpy as np

from servo_identify.experiment.offline_bench import make
from servo_identify.experiment.procedures import Run
from servo_twin.bag import read_recording
from servo_twin.description.shipped import servo_at, shipped
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

SERVO, RIG = 'ema_bench', 'rigs/ema_bench.yaml'
PERIOD = 1e-3
SETTINGS = (0.0096, 0.010, 0.011, 0.0125, 0.014)
"""m: flanks that touch, and the settings of the paper's figures with one between."""

BRAKES = (0.0, 0.5, 1.0, 1.5, 2.0)  # N m
CURVE = (0.0097, 0.0099, 0.0103, 0.0107, 0.0114, 0.0120, 0.0129, 0.0135, 0.0143)  # m
LEARNED = ((0.0098, 0.25), (0.0105, 1.8), (0.0117, 0.75), (0.0132, 1.25), (0.0138, 0.0))


@dataclass(frozen=True)
class Case:
    """One recording: where the slide stands (m), what the brake is asked (N m), the sinusoid."""

    name: str
    setting: float
    brake: float
    amplitude: float
    frequency: float
    seed: int
    phase: float = 0.0
    duration: float = 20.0

    @property
    def run(self) -> Run:
        """The set-points: a sinusoid of the position of the load, rad."""
        t = np.arange(round(self.duration / PERIOD)) * PERIOD
        wave = self.amplitude * np.sin(2.0 * pi * self.frequency * t + self.phase)
        return Run(self.name, 'sine', 'position', PERIOD, wave, np.zeros(len(t)))

    @property
    def turned(self) -> tuple[str, ...]:
        """What the rig is set to."""
        return f'carrier.setting={self.setting}', f'brake.torque={self.brake}'

    def of(self, servo: Servo) -> Servo:
        """Return the servo set as the bench was."""
        return servo.with_values({'effects.play.setting': self.setting,
                                  'effects.brake.asked': self.brake})


def grid(settings: Sequence[float] = SETTINGS, brakes: Sequence[float] = BRAKES, replicate: int = 0
         ) -> list[Case]:
    """Return the cases that are judged; another replicate is the bench switched on again."""
    return [Case(f'grid_{1e3 * s:g}mm_{b:g}Nm_{replicate}', s, b, 0.5, 0.1,
                 1000 * (replicate + 1) + 10 * i + j, phase=0.05 * (i - j))
            for i, s in enumerate(settings) for j, b in enumerate(brakes)]


def curve(settings: Sequence[float] = CURVE) -> list[Case]:
    """Return the cases of the backlash: without brake, slow."""
    return [Case(f'play_{1e3 * s:g}mm', s, 0.0, 0.6, 0.08, 3000 + i, duration=25.0)
            for i, s in enumerate(settings)]


def learned() -> list[Case]:
    """Return the cases of the identification."""
    return [Case(f'learned_{1e3 * s:g}mm_{b:g}Nm', s, b, 0.6 - 0.05 * k, 0.07 + 0.02 * k, 4000 + k)
            for k, (s, b) in enumerate(LEARNED)]


def recorded(cases: Sequence[Case], folder: Path, told: Callable[[str, float], None] | None = None,
             rig: Path | None = None, workers: int = 2) -> list[Recording]:
    """
    Return the recordings of cases, making those that ``folder`` does not hold yet.

    A bag is regenerated when its set-points, its seed, its settings or the rig file have changed.
    """
    rig = rig or shipped(RIG)
    folder.mkdir(parents=True, exist_ok=True)

    def one(case: Case) -> Recording:
        bag, note = folder / case.name, folder / f'{case.name}.json'
        run = case.run
        mark = {'set_points': hashlib.sha256(run.reference.tobytes()).hexdigest(),
                'seed': case.seed, 'turned': list(case.turned),
                'rig': hashlib.sha256(rig.read_bytes()).hexdigest()}
        if not (bag.exists() and note.exists() and json.loads(note.read_text()) == mark):
            shutil.rmtree(bag, ignore_errors=True)
            note.unlink(missing_ok=True)
            make(run, folder, rig, SERVO, servo_at(SERVO).read_text(), case.turned, case.seed)
            note.write_text(json.dumps(mark))
        return read_recording(bag)

    found = []
    with ThreadPoolExecutor(workers) as pool:
        for k, recording in enumerate(pool.map(one, cases)):
            found.append(recording)
            if told:
                told(f'recording {cases[k].name}', (k + 1) / len(cases))
    return found
