"""
Recordings of the emulated geared DC motor, its twin, and the learners of its friction.

Learners and fit see the training recordings only. The unseen ones have other voltages, other
frequencies, another order of their steps and other sensor noise; one of them is faster than all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.experiment.procedures import Choices, PROCEDURES
from servo_identify.fit.output_error import fit
from servo_identify.learn.free_run import free_runs
from servo_identify.learn.friction.friction_dataset import Dataset, dataset_of
from servo_identify.learn.friction.friction_samples import friction_of
from servo_identify.learn.friction.learner_comparison import best_of, compared, markdown, plain
from servo_identify.learn.friction.learners import names
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ..bench_recordings import Part, recorded
from . import geared_dc_plots

SERVO, RIG = 'dc_gearmotor', 'rigs/dc_gearmotor.yaml'
SECONDS = 40.0  # at most, for each learner
FEATURES_OF = {'equation_5': (), 'motion': ('current',)}
"""What the learners are not given: nothing as in the paper's eq. 5, or the current."""

SHOWN = (1, 5)  # of the unseen recordings, in pictures: one of steps, one of sines
FREE = ('drive.resistance', 'drive.back_emf', 'mechanism.rotor_inertia',
        'effects.coulomb.level', 'effects.viscous.slope')
"""What is fitted. Without a torque sensor the torque constant only scales the torques."""

Told = Callable[[str, float], None]


def plan() -> tuple[Part, ...]:
    """Return the recordings to train on, and unseen, and unseen and faster (paper 003, 3.2)."""
    def runs(steps: tuple[float, ...], sines: tuple[float, ...], *tones: float) -> tuple:
        chosen = ('multilevel_steps', Choices(duration=22.5, amplitudes=steps)), (
            'sinusoids', Choices(duration=25.0, amplitudes=sines, frequencies=tones))
        return tuple(run for name, choices in chosen
                     if choices.amplitudes for run in PROCEDURES[name].runs(choices))

    return (Part('training', True, runs((2.0, 4.0, 6.0, 9.0), (2.0, 4.0, 6.0, 9.0), 0.1, 2.0),
                 100),
            Part('unseen', False, runs((3.0, 5.0, 8.0), (3.0, 5.0, 8.0), 0.15, 1.5), 200),
            Part('faster', False, runs((12.0,), ()), 300))


def make(work: Path, pictured: Path, told: Told) -> dict:
    """Record, fit, diagnose, learn and draw; return the figures."""
    parts = plan()
    recordings = recorded(work / 'geared_dc', lambda name, ready, all_: told(
        f'recording {name}', 0.05 * ready / all_), parts, SERVO, RIG)
    servo = servo_file.load(servo_at(SERVO))
    found = {'recordings': {part.name: [run.name for run in part.runs] for part in parts},
             'duration': sum(r.duration for several in recordings.values() for r in several)}
    told('diagnosing', 0.05)
    found['diagnosis'], augmented = diagnosed(servo, recordings)
    told('fitting', 0.2)
    found['twin'] = twin_figures(servo, augmented, recordings, pictured, work)
    found['balance'] = balance_figures(servo, recordings['unseen'])
    share = iter(np.linspace(0.3, 1.0, 2 * len(names()) + 1))
    shown = {parts[1].runs[k].name: len(parts[0].runs) + k for k in SHOWN}
    for key, without in FEATURES_OF.items():
        data = friction_data(servo, recordings, without)
        found[key] = learner_figures(
            data, names(), SECONDS, pictured / f'geared_dc_{key}', shown,
            lambda said, key=key: told(f'{key}: {said}', next(share, 1.0)))
    return found


def twin_figures(servo: Servo, augmented: Servo, recordings: Mapping[str, list[Recording]],
                 pictured: Path, work: Path) -> dict:
    """Return R (paper 000 eq. 13) of free runs over unseen recordings, and what was fitted."""
    estimate = fit(servo, recordings['training'], FREE)
    servo_file.save(estimate.servo, work / f'{SERVO}_fitted.yaml')
    unseen = recordings['unseen']
    runs = {name: free_runs(one, unseen) for name, one in (
        ('data sheet', servo), ('fitted', estimate.servo), ('augmented', augmented))}
    geared_dc_plots.twin(runs, SHOWN, pictured / 'geared_dc_twin.png')
    return {'names': [r.name for r in unseen], 'seconds': estimate.seconds,
            'fit': {name: [float(run.speed_fit) for run in several]
                    for name, several in runs.items()},
            'values': {path: [servo.values[path], estimate.values[path], estimate.std[path],
                              estimate.units[path]] for path in FREE}}


def diagnosed(servo: Servo, recordings: Mapping[str, list[Recording]]) -> tuple[dict, Servo]:
    """Return what the diagnosis says of the twin of the data sheet, and the augmented twin."""
    training, unseen = recordings['training'], recordings['unseen']
    found = diagnose(training[::2], servo, training[1::2], unseen)
    report = found.report
    said = {'sentence': report.verdict['sentence'], 'status': report.verdict['status'],
            'shrink': report.gap['shrink'],
            'effects': [f'{cause.effect} at the {cause.site}' for cause in report.which]}
    return said, found.augmented


def balance_figures(servo: Servo, recordings: list[Recording]) -> dict:
    """Return how far friction by eq. 4 from voltage and speed is from that of the current, N m."""
    blind = [replace(r, columns={**r.columns, 'current': np.full(len(r), np.nan)})
             for r in recordings]
    seen, guessed = friction_of(servo, recordings), friction_of(servo, blind)
    return {'rms': float(np.sqrt(np.mean((seen.torque - guessed.torque) ** 2))),
            'spread': float(np.std(seen.torque))}


def friction_data(servo: Servo, recordings: Mapping[str, list[Recording]],
                  without: tuple[str, ...] = ()) -> Dataset:
    """Return friction by paper 003 eq. 4 as features and target, the unseen runs kept back."""
    train = recordings['training']
    new = [*recordings['unseen'], *recordings['faster']]
    return dataset_of(friction_of(servo, [*train, *new]), without=without,
                      unseen=range(len(train), len(train) + len(new)))


def learner_figures(data: Dataset, learners: list[str], seconds: float, pictured: Path,
                    shown: Mapping[str, int], told: Callable[[str], None] = lambda name: None
                    ) -> dict:
    """
    Train every learner on the same rows, and draw figures 1 to 3 of the paper.

    Pictures are named ``pictured`` and what they show; ``shown`` are the runs to draw over time,
    with their titles; ``told`` is given each learner's name.
    """
    losses: dict[str, list[tuple[float, float]]] = {}

    def heard(name: str, epoch: int, loss: float, held: float) -> None:
        if name not in losses:
            told(name)
        losses.setdefault(name, []).append((loss, held))

    rows, models = compared(data, learners, seconds=seconds, told=heard)
    best = best_of(rows).name
    drawn = 'lstm' if 'lstm' in models else best
    several = {name: models[name] for name in dict.fromkeys((drawn, best, 'dahl'))
               if name in models}
    at = {what: pictured.with_name(f'{pictured.name}_{what}.png') for what in (
        'time', 'speed', 'losses')}
    geared_dc_plots.over_time(data, several, shown, at['time'])
    geared_dc_plots.over_speed(data, several, at['speed'])
    geared_dc_plots.losses(losses[drawn], drawn, at['losses'])
    return {'table': markdown(rows), 'rows': plain(rows), 'best': best, 'limit': seconds,
            'spread': float(np.std(data.target[data.unseen])),
            'samples': {part: len(getattr(data, part)) for part in (
                'train', 'validation', 'test', 'unseen', 'beyond')}}
