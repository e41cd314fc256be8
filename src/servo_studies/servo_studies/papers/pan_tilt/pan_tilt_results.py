"""The figures of the pan-and-tilt: models ranked, step and slow sine, both axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.jobs.harmonic_drive_ranking import LINEAR, Ranked, ranked
from servo_identify.learn.free_run import EDGE, free_runs, speed_of
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.physics.fixed_inertia import with_fixed_inertia
from servo_twin.physics.harmonic_drive_models import NAMES, with_harmonic_drive
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from ..bench_recordings import recorded
from . import pan_tilt_plots
from .pan_tilt_recordings import AZIMUTH, both_axes, plan, SINE, STARTS, STEP, TONE

STILL = 0.01  # rad/s at the load, below which it stands
TOP = 0.98  # share of its largest speed from which the top of a sine is flat
INERTIAS = ('mechanism.load_inertia', 'effects.payload.level', 'effects.payload.cosine',
            'effects.payload.sine')
"""What the azimuth turns, by the servo file."""

Told = Callable[[str, float], None]


def make(work: Path, pictured: Path, told: Told) -> dict:
    """Record, fit, rank, diagnose and draw; return the figures."""
    sets = recorded(work / 'pan_tilt', lambda name, ready, all_: told(
        f'recording {name}', 0.1 * ready / all_), plan(), AZIMUTH, f'rigs/{AZIMUTH}.yaml')
    servo = servo_file.load(servo_at(AZIMUTH))
    order = ranked(servo, sets['training'], sets['held_out'],
                   lambda what, share: told(f'fitting {what}', 0.1 + 0.6 * share))
    by_name = {one.name: one for one in order}
    best = next(one for one in order if one.name != LINEAR)
    for one in order:
        servo_file.save(one.servo, work / f'{AZIMUTH}_{one.name}.yaml')
    told('diagnosing the best', 0.7)
    found = {'ranking': [_row(one) for one in order], 'best': best.title,
             'diagnosis': _diagnosed(best.servo, sets)}
    told('step and sine', 0.85)
    linear = unlimited(by_name[LINEAR].servo)
    sine = next(r for r in sets['held_out'] if r.name.startswith(f'sine_{SINE:g}V'))
    step = next(r for r in sets['held_out'] if r.family == 'square')
    named = {'linear model': linear, f'twin, {best.title}': best.servo}
    found['step'] = responses(named, step, _of_step)
    found['sine'] = responses(named, sine, _of_sine)
    pan_tilt_plots.responses(named, step, pictured / 'pan_tilt_step.png', f'step of {STEP:g} V')
    pan_tilt_plots.responses(named, sine, pictured / 'pan_tilt_sine.png',
                       f'sine of {SINE:g} V at {TONE:g} Hz')
    pan_tilt_plots.ranking(order, pictured / 'pan_tilt_models.png')
    twisted = next(r for r in sets['held_out'] if r.family == 'hold')
    pan_tilt_plots.loops({one.title: one.servo for one in order}, twisted,
                   pictured / 'pan_tilt_loops.png')
    told('both axes', 0.9)
    found['axes'] = _axes(both_axes(work / 'pan_tilt' / 'both'), servo, best, pictured)
    found['recorded'] = {name: [r.name for r in group] for name, group in sets.items()}
    return found


def unlimited(servo: Servo) -> Servo:
    """Return a servo whose amplifier has no limits and whose encoders read all: linear."""
    counts = tuple(p for p in servo.effects if p.effect.name == 'encoder_counts')
    changes = {'drive.supply': 1e5, 'drive.current_limit': 1e5}
    changes |= {f'effects.{p.name}.count': 0.0 for p in counts}
    return servo.with_values(changes)


def responses(servos: Mapping[str, Servo], recording: Recording,
              facts: Callable[[np.ndarray, float], dict]) -> dict:
    """Return what is seen of a response: of the rig, and of each servo with its R (eq. 13)."""
    period = recording.period
    measured = speed_of(recording['load_position'], period)
    found = {'rig': facts(measured, period)}
    for name, servo in servos.items():
        run = free_runs(servo, [recording])[0]
        found[name] = {**facts(run.predicted, period), 'fit': run.speed_fit}
    return found


def _of_step(speed: np.ndarray, period: float) -> dict:
    final = float(np.mean(speed[-round(1.0 / period):]))
    over = np.flatnonzero(speed > 0.632 * final)
    return {'final': final, 'rise': float(over[0] * period - STARTS) if len(over) else np.nan}


def _of_sine(speed: np.ndarray, period: float) -> dict:
    inner = speed[EDGE:-EDGE]
    top = float(np.percentile(np.abs(inner), 99.5))
    return {'still': float(np.mean(np.abs(inner) < STILL)), 'top': top,
            'flat': float(np.mean(np.abs(inner) > TOP * top))}


def _row(one: Ranked) -> dict:
    own = {path.removeprefix('effects.'): [value, one.servo.unit(path)]
           for path, value in one.servo.values.items()
           if path.startswith('effects.') and path.split('.')[1] in NAMES}
    return {'name': one.name, 'title': one.title, 'gap': one.gap, 'shrink': one.shrink,
            'interval': list(one.interval), 'errors': dict(one.errors), 'free': one.free,
            'seconds': one.seconds, 'values': own}


def _diagnosed(servo: Servo, sets: Mapping[str, Sequence[Recording]]) -> dict:
    report = diagnose(list(sets['training']), servo, list(sets['accept']),
                      list(sets['held_out'])).report
    return {'sentence': report.verdict['sentence'], 'status': report.verdict['status'],
            'before': report.gap['as_given'], 'after': report.gap['after'],
            'floor': report.gap['floor'],
            'causes': [f'{cause.effect} at the {cause.site}' for cause in report.which],
            'where': [[one.balance, one.gap_to_noise, one.verdict] for one in report.where]}


def _axes(recording: Recording, servo: Servo, best: Ranked, pictured: Path) -> dict:
    """Return R of the azimuth over a nodding elevation, with and without the coupling."""
    moving = with_harmonic_drive(servo, best.name)
    moving = replace(moving, tolerance={}, values={**moving.values, **{
        path: value for path, value in best.servo.values.items()
        if path in moving.values and path not in INERTIAS}})
    share = (best.servo.values[INERTIAS[0]]
             / with_fixed_inertia(servo, 0.0).values[INERTIAS[0]])  # as fitted, elevation level
    moving = moving.with_values({path: share * moving.values[path] for path in INERTIAS})
    tilts = recording['coupled_position']
    twins = {'inertia over elevation': moving,
             'elevation taken as level': with_fixed_inertia(moving, 0.0),
             'elevation taken at its mean': with_fixed_inertia(moving, float(np.mean(tilts)))}
    runs = {name: free_runs(one, [recording])[0] for name, one in twins.items()}
    pan_tilt_plots.axes(runs, pictured / 'pan_tilt_axes.png')
    inertia = [with_fixed_inertia(moving, a).values['mechanism.load_inertia']
               for a in (float(np.min(tilts)), float(np.max(tilts)))]
    return {'tilt': [float(np.min(tilts)), float(np.max(tilts))], 'inertia': inertia,
            'fit': {name: [run.speed_fit, run.angle_fit] for name, run in runs.items()},
            'rms': {name: float(np.sqrt(np.mean((run.predicted - run.measured)[EDGE:-EDGE] ** 2)))
                    for name, run in runs.items()}}
