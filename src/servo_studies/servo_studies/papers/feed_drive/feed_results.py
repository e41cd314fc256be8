"""
Recordings of the emulated feed drive's two axes, the network beside each twin, and their errors.

The networks see F1000 and F6000 of their axis only, as in the paper; all that is judged has other
speeds, and other noise. Both twins are given the wanted position and nothing of what the rig did.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from servo_identify.experiment import setpoint_profiles
from servo_identify.experiment.procedures import Run
from servo_identify.learn.free_run import rolled
from servo_identify.learn.networks.deviation_network import (
    learned_deviation,
    LearnedDeviation,
    with_deviation,
)
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ..bench_recordings import Part, recorded
from . import feed_plots
from .feed_errors import Circle, Judged, PERIOD, RADIUS, SETTLED
from .inverter_switching import inverter_figures

AXES = {'x': 'feed_drive', 'y': 'feed_drive_y'}
RATES = (1000, 2000, 3000, 4000, 5000, 6000)  # mm/min, the largest of each sine
TRAINED = (1000, 6000)
AMPLITUDE = 0.1  # m, of figure 8a of the paper
TURNS = (60, 80, 100, 120)  # rad/min, of the circle
EASE = 0.5  # s in which a motion sets off
WARMER = 4.0  # K, of the machine that the network has not seen

Told = Callable[[str, float], None]


def sine(rate: float) -> np.ndarray:
    """Return one whole cycle of the sine of place whose largest speed is ``rate`` mm/min, m."""
    speed = rate / 60e3
    time = np.arange(round((2.0 * np.pi * AMPLITUDE / speed + EASE) / PERIOD)) * PERIOD
    return AMPLITUDE * np.sin(speed / AMPLITUDE * setpoint_profiles.set_off(time, EASE))


def circle(turn: float) -> dict[str, np.ndarray]:
    """
    Return the wanted places, m, of both axes on one round of a circle and a little more.

    It begins where both axes stand, at zero: its centre is at x = -RADIUS.
    """
    speed = turn / 60.0
    time = np.arange(round((2.0 * np.pi / speed + SETTLED) / PERIOD)) * PERIOD
    phase = speed * setpoint_profiles.set_off(time, EASE)
    return {'x': RADIUS * (np.cos(phase) - 1.0), 'y': RADIUS * np.sin(phase)}


def run_of(name: str, reference: np.ndarray) -> Run:
    """Return a run in the position loop without a cutting force."""
    return Run(name, 'feed', 'position', PERIOD, reference, np.zeros(len(reference)))


def plan(axis: str, rates: Sequence[int] = RATES, turns: Sequence[int] = TURNS
         ) -> tuple[Part, ...]:
    """Return the recordings of one axis; no two have the same noise."""
    seed = 100 if axis == 'x' else 500
    sines = {rate: run_of(f'F{rate}', sine(rate)) for rate in rates}
    return (
        Part('training', True, tuple(sines[rate] for rate in rates if rate in TRAINED), seed),
        Part('sines', False, tuple(sines.values()), seed + 100),
        Part('circle', False, tuple(run_of(f'circle_{t}', circle(t)[axis]) for t in turns),
             seed + 200))


def make(work: Path, pictured: Path, told: Told) -> dict:
    """Record, learn, judge and draw; return the figures."""
    folder = work / 'feed_drive'
    recordings, models, learned = {}, {}, {}
    for k, (axis, name) in enumerate(AXES.items()):
        recordings[axis] = recorded(folder / axis, lambda what, ready, all_, k=k, axis=axis: told(
            f'recording {axis} {what}', 0.25 * (k + ready / all_)), plan(axis), name,
            f'rigs/{name}.yaml')
        told(f'learning {axis}', 0.25 * (k + 1))
        analytical = servo_file.load(servo_at(name))
        learned[axis] = learned_deviation(analytical, recordings[axis]['training'])
        models[axis] = {'analytical': analytical,
                        'hybrid': with_deviation(analytical, learned[axis])}
        servo_file.save(models[axis]['hybrid'], work / f'{name}_hybrid.yaml')
    told('judging', 0.6)
    found = {'axes': {}, 'trained': list(TRAINED), 'turns': list(TURNS)}
    for axis in AXES:
        runs = {r.name: judged(models[axis], r) for r in recordings[axis]['sines']}
        found['axes'][axis] = {'errors': {n: run.figures() for n, run in runs.items()},
                               'training': training_figures(learned[axis])}
        feed_plots.errors(runs, pictured / f'feed_drive_errors_{axis}.png')
    told('recording a warm machine', 0.7)
    found['warm'] = warm_figures(folder, models['x'])
    told('judging the circle', 0.8)
    circles = {t: Circle(*(judged(models[axis], recordings[axis]['circle'][k]) for axis in AXES))
               for k, t in enumerate(TURNS)}
    found['circle'] = {str(t): c.figures() for t, c in circles.items()}
    feed_plots.circles(circles, RADIUS, pictured / 'feed_drive_circle.png')
    feed_plots.contours(circles, pictured / 'feed_drive_contour.png')
    told('switching the inverter', 0.9)
    found['inverter'] = inverter_figures(models['x']['analytical'], sine(6000)[:1200],
                                         pictured / 'feed_drive_inverter.png')
    return found


def judged(models: Mapping[str, Servo], recording: Recording) -> Judged:
    """Return a recording with what the models predict of it, in their closed loop."""
    return Judged(recording, {name: rolled(servo, recording, 'closed_loop')[:, 1]
                              for name, servo in models.items()})


def training_figures(learned: LearnedDeviation) -> dict[str, float]:
    """Return how well a network does on the seconds that were kept back from its training."""
    return {'rmse': 1e6 * learned.scores.rmse, 'r2': learned.scores.r2,
            'iterations': len(learned.network.losses), 'weights': learned.network.size}


def warm_figures(folder: Path, models: Mapping[str, Servo]) -> dict:
    """Return the errors at F4000 of a machine warmer than the one that was learned from."""
    start = 20.5 + WARMER
    part = Part('warm', False, (run_of('F4000', sine(4000)),), 900)
    recording = recorded(folder / 'x', None, (part,), AXES['x'], f'rigs/{AXES["x"]}.yaml',
                         (f'thermal.start={start}',))['warm'][0]
    return {'warmer': WARMER, 'errors': judged(models, recording).figures()}
