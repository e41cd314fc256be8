"""The part of the result that the emulated bench gives: figures ready for JSON, and pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.recording import Recording

from ..fitting.command import write
from ..friction.pictures import friction_angle
from ..transmission.error import ARCMIN
from . import figures, pictures
from .models import learned, Models
from .recordings import recorded

PICTURED = ('sine_1.5V_1Hz', 'square_1.8V_0.5Hz')  # those of figure 11
Told = Callable[[str, float], None]
"""Is given what goes on, and the share that is done."""


def bench(work: Path, pictured: Path, told: Told) -> dict:
    """
    Record, learn, judge and draw; return the figures.

    Recordings are kept in ``work``, and the learned servo files are written there; pictures go
    to ``pictured``.
    """
    recordings = recorded(work / 'bench', lambda name, ready, all_: told(
        f'recording {name}', 0.6 * ready / all_))
    stages = iter(np.linspace(0.6, 0.9, 400))
    models = learned(recordings, lambda stage: told(stage, float(next(stages, 0.9))))
    for name, servo in models.servos.items():
        write(servo, work / f'{name.replace(" + ", "_").replace(" ", "_")}.yaml')
    told('judging', 0.9)
    found = _open_loop(models, recordings['open_loop_test'], pictured)
    found |= _closed_loop(models.servos, recordings, pictured)
    found |= _learned(models, pictured)
    found['recorded'] = {name: sum(r.duration for r in group)
                         for name, group in recordings.items()}
    return found


def _open_loop(models: Models, recordings: list[Recording], pictured: Path) -> dict:
    runs = figures.open_loop(models.servos, recordings)
    names = [r.name for r in recordings]
    table = {model: {'speed': [r.speed_fit for r in several],
                     'angle': [r.angle_fit for r in several]} for model, several in runs.items()}
    pictures.open_loop(runs, PICTURED, pictured / 'results_open_loop.png')
    pictures.fits({model: rows['speed'] for model, rows in table.items()}, names,
                  pictured / 'results_fits.png')
    ladder = []
    for model, several in figures.open_loop(models.ladder, recordings).items():
        speed, angle = ([getattr(r, f'{what}_fit') for r in several] for what in (
            'speed', 'angle'))
        ladder.append({'model': model, 'mean': float(np.mean(speed)), 'least': min(speed),
                       'angle_mean': float(np.mean(angle))})
    return {'names': names, 'open_loop': table, 'ladder': ladder}


def _closed_loop(servos: Mapping[str, Servo], recordings: Mapping[str, list[Recording]],
                 pictured: Path) -> dict:
    speed = figures.velocity_loop(servos, recordings['velocity_loop'][0])
    pictures.velocity_loop(speed, pictured / 'results_velocity_loop.png')
    torque = figures.torque_over_turn(servos, recordings['reversal'][0])
    pictures.torque(torque, pictured / 'results_torque.png')
    angle = figures.reversals(servos, recordings['position_ramp'])
    pictures.reversals(angle, pictured / 'results_reversal.png')
    return {'velocity_loop': {'fit': speed.fits(), 'rms': speed.errors()},
            'torque': {way: {'fit': c.fits(), 'rms': c.errors()} for way, c in torque.items()},
            'reversal': {c.title: {'rms': c.errors()} for c in angle}}


def _learned(models: Models, pictured: Path) -> dict:
    friction_angle(models.friction, pictured / 'results_friction_angle.png')
    error, loop, share = models.error, models.loop, models.friction.share
    return {
        'friction': {'forward': vars(models.friction.forward_scores),
                     'reverse': vars(models.friction.reverse_scores)},
        'motor_friction': {'forward': vars(models.motor_friction.forward_scores),
                           'reverse': vars(models.motor_friction.reverse_scores)},
        'backlash': {**vars(models.backlash.scores), 'orders': models.backlash.orders,
                     'loads': models.backlash.loads.tolist(),
                     'gaps': (models.backlash.gaps.mean(axis=1) / ARCMIN).tolist()},
        'transmission_error': {
            'orders': list(error.orders), 'forward': (np.abs(error.forward) / ARCMIN).tolist(),
            'reverse': (np.abs(error.reverse) / ARCMIN).tolist(),
            'invariance': [error.steadiness[o] for o in error.orders],
            'mse': [s.mse for s in error.scores]},
        'current_loop': {'values': loop.values, 'std': loop.std, 'rms': loop.rms,
                         'rms_without': loop.rms_without},
        'load_share': {'share': share.share, 'std': share.share_std} if share else {},
        'presliding': {k: getattr(models.presliding, k) for k in (
            'level', 'breakaway', 'before', 'after')},
        'residual': vars(models.residual.scores),
        'traditional': {k: v for k, v in models.servos['traditional'].values.items()
                        if not isinstance(v, tuple) and k.startswith((
                            'effects.coulomb', 'effects.viscous', 'effects.stribeck',
                            'effects.gap', 'mechanism', 'drive'))}}
