"""
The part of the result that the EMA bench of paper 002 gives: its page, its row in the comparison.

`make` records, measures the backlash over the slide, identifies, judges the grid and draws.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from servo_identify.fit.estimate import bag_name
from servo_identify.learn.transmission.two_way_backlash import measured_play, with_curve
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.recording.recording import Recording

from . import ema_plots, ema_recordings
from .ema_diagnosis import CASES, diagnosed
from .ema_errors import Judged, judged, SIGNALS
from .ema_model import identified
from .ema_page import comparison_rows, page

__all__ = ['comparison_rows', 'make', 'page']

REPLICATES = 2  # of the grid beside the one that is judged, for the floor
SHOWN = (0.010, 0.011, 0.014)  # m, of the paper's figures


def make(work: Path, pictured: Path, told: Callable[[str, float], None]) -> dict:
    """Return the figures; recordings are kept in ``work``, pictures go to ``pictured``."""
    folder = work / 'ema_bench'

    def part(low: float, high: float) -> Callable[[str, float], None]:
        return lambda said, share: told(said, low + (high - low) * share)

    drawing = servo_file.load(servo_at(ema_recordings.SERVO))
    cases = ema_recordings.curve()
    recordings = ema_recordings.recorded(cases, folder / 'play', part(0.0, 0.1))
    plays = {case.setting: measured_play(drawing, recording)
             for case, recording in zip(cases, recordings, strict=True)}
    curved = with_curve(drawing, plays, [bag_name(one) for one in recordings])
    learned = ema_recordings.learned()
    servo, std = identified(curved, learned, ema_recordings.recorded(learned, folder / 'learned',
                                                           part(0.1, 0.15)), part(0.15, 0.3))
    servo_file.save(servo, work / 'ema_bench.yaml')
    grid = ema_recordings.grid()
    first = ema_recordings.recorded(grid, folder / 'grid', part(0.3, 0.5))
    others = [ema_recordings.recorded(ema_recordings.grid(replicate=k), folder / 'grid',
                                      part(0.4 + 0.1 * k, 0.5 + 0.1 * k))
              for k in range(1, REPLICATES + 1)]
    found = []
    for k, (case, recording) in enumerate(zip(grid, first, strict=True)):
        found.append(judged(servo, case, recording, [again[k] for again in others]))
        told(f'judging {case.name}', 0.75 + 0.15 * (k + 1) / len(grid))
    said = diagnosed(servo, {at: _replicates(grid, [first, *others], at) for _, at, _ in CASES},
                     part(0.9, 1.0))
    ema_plots.play(drawing, plays, pictured / 'ema_bench_play.png')
    ema_plots.heat(found, pictured / 'ema_bench_grid.png')
    ema_plots.traces(found, SHOWN, max(ema_recordings.BRAKES), pictured / 'ema_bench_traces.png')
    return {
        'play': [{'setting': s, 'width': p.width, 'std': p.std, 'varies': p.varies,
                  'wound': p.wound, 'drawn': float(np.interp(
                      s, drawing.values['effects.play.settings'],
                      drawing.values['effects.play.widths']))} for s, p in plays.items()],
        'turn': {k: servo.values[f'effects.play.{k}'] for k in ('cosine', 'sine')},
        'learned': [[c.setting, c.brake, c.amplitude, c.frequency] for c in learned],
        'played': [[c.amplitude, c.frequency, c.duration] for c in (grid[0], cases[0])],
        'identified': [[name, _at(drawing, name), _at(servo, name), std[name],
                        servo.unit(name.partition('[')[0])] for name in std],
        'grid': [_kept(one) for one in found], 'diagnosed': said,
        'step': servo.step}


def _replicates(grid: list[ema_recordings.Case], replicates: list[list[Recording]],
                at: tuple[float, float]) -> list[Recording]:
    k = next(k for k, case in enumerate(grid) if (case.setting, case.brake) == at)
    return [several[k] for several in replicates]


def _at(servo, name: str) -> float:
    path, _, rest = name.partition('[')
    value = servo.values[path]
    return float(value[int(rest[:-1])] if rest else value)


def _kept(one: Judged) -> dict:
    return {'setting': one.case.setting, 'brake': one.case.brake, 'phase': one.case.phase,
            'ratio': one.ratio, 'wall': one.wall, 'late': one.late,
            'frequency_error': one.command_error[0], 'phase_error': one.command_error[1],
            'response_error': one.response_error,
            'signals': {name: {'n': a.n, 'mse': a.mse, 'se': float(a.se), 'rmse': float(a.rmse),
                               'floor': a.floor, 'signal': a.signal}
                        for name, a in ((name, one.signals[name]) for name in SIGNALS)}}
