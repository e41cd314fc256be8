"""The part of the result that the emulated bench gives: figures ready for JSON, and pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from servo_identify.learn.friction.friction_plots import friction_angle
from servo_identify.learn.transmission.transmission_harmonics import ARCMIN
from servo_twin.description import servo_file
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from . import model_errors, results_plots
from .bench_recordings import recorded
from .compared_models import data_sheet, learned, Models
from .paper_systems import SYSTEMS

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
        servo_file.save(servo, work / f'{name.replace(" + ", "_").replace(" ", "_")}.yaml')
    told('judging', 0.9)
    found = _open_loop(models, recordings['open_loop_test'], pictured)
    found |= _closed_loop(models.servos, recordings, pictured)
    found |= _learned(models, pictured)
    found['recorded'] = {name: sum(r.duration for r in group)
                         for name, group in recordings.items()}
    return found


def _open_loop(models: Models, recordings: list[Recording], pictured: Path) -> dict:
    runs = model_errors.open_loop(models.servos, recordings)
    names = [r.name for r in recordings]
    table = {model: {'speed': [r.speed_fit for r in several],
                     'angle': [r.angle_fit for r in several]} for model, several in runs.items()}
    results_plots.open_loop(runs, PICTURED, pictured / 'results_open_loop.png')
    results_plots.fits({model: rows['speed'] for model, rows in table.items()}, names,
                  pictured / 'results_fits.png')
    ladder = []
    for model, several in model_errors.open_loop(models.ladder, recordings).items():
        speed, angle = ([getattr(r, f'{what}_fit') for r in several] for what in (
            'speed', 'angle'))
        ladder.append({'model': model, 'mean': float(np.mean(speed)), 'least': min(speed),
                       'angle_mean': float(np.mean(angle))})
    return {'names': names, 'open_loop': table, 'ladder': ladder}


def _closed_loop(servos: Mapping[str, Servo], recordings: Mapping[str, list[Recording]],
                 pictured: Path) -> dict:
    speed = model_errors.velocity_loop(servos, recordings['velocity_loop'][0])
    results_plots.velocity_loop(speed, pictured / 'results_velocity_loop.png')
    torque = model_errors.torque_over_turn(servos, recordings['reversal'][0],
                                           data_sheet().numbers['drive.torque_constant'])
    results_plots.torque(torque, pictured / 'results_torque.png')
    angle = model_errors.reversals(servos, recordings['position_ramp'])
    results_plots.reversals(angle, pictured / 'results_reversal.png')
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


def comparison_rows(found: Mapping) -> list[dict[str, str]]:
    """Return the rows of docs/comparison.md from the figures of :func:`bench`."""
    def mean(shape: str, model: str) -> float:
        fits = found['open_loop'][model]['speed']
        return float(np.mean([r for r, n in zip(fits, found['names'], strict=True)
                              if n.startswith(shape)]))

    fits = [f'{mean("sine", m):.3f} (sine) and {mean("square", m):.3f} (square)'
            for m in ('hybrid', 'traditional')]
    friction = [found['friction'][way] for way in ('forward', 'reverse')]
    speed, error = found['velocity_loop']['rms'], found['transmission_error']['mse']
    torque = [f'{1e3 * c["rms"]["hybrid"]:.2f} mN m {way} (traditional '
              f'{1e3 * c["rms"]["traditional"]:.2f})' for way, c in found['torque'].items()]
    angle = [f'{c["rms"]["hybrid"] / ARCMIN:.3f}' for c in found['reversal'].values()]
    plain = [f'{c["rms"]["traditional"] / ARCMIN:.3f}' for c in found['reversal'].values()]
    degree = 180.0 / np.pi
    ours = (
        ('sixteen free runs over traditional, residual network and hybrid',
         f'mean R of the hybrid {fits[0]}, traditional {fits[1]}'),
        ('2-30-1 networks of angle and speed, both directions',
         f'MAE {friction[0]["mae"]:.3f} N m forward, {friction[1]["mae"]:.3f} reverse; '
         f'MAPE {friction[0]["mape"]:.2f} % and {friction[1]["mape"]:.2f} %'),
        ('2-30-1 network of angle and load',
         f'MAE {found["backlash"]["mae"]:.2g} arcmin, MAPE {found["backlash"]["mape"]:.2g} %'),
        ('order spectrum and its harmonics, both directions',
         f'MSE {error[0]:.5f} arcmin2 forward, {error[1]:.5f} reverse'),
        ('rig and twin under the same PI loop',
         f'RMS error of the hybrid {degree * speed["hybrid"]:.4f} deg/s, traditional '
         f'{degree * speed["traditional"]:.4f}'),
        ('rig and twin in the velocity loop', 'RMS error of the hybrid ' + ', '.join(torque)),
        ('rig and twin in the position loop', f'RMS error of the hybrid {", ".join(angle)} '
         f'arcmin, traditional {", ".join(plain)}'))
    names = [system.name for system in SYSTEMS if system.part == 'bench']
    return [{'system': name, 'runs': runs, 'paper': '', 'ours': text, 'command': ''}
            for name, (runs, text) in zip(names, ours, strict=True)]
