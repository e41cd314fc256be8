"""The learners of friction on one table, and their picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from servo_identify.learn.friction.friction_dataset import dataset_of
from servo_identify.learn.friction.friction_plots import friction_speed
from servo_identify.learn.friction.friction_samples import friction_of
from servo_identify.learn.friction.learner_comparison import best_of, compared, markdown, plain
from servo_identify.learn.friction.learners import names

from .bench_recordings import plan, recorded
from .compared_models import data_sheet
from .paper_systems import SYSTEMS


def learners(work: Path, pictured: Path, seconds: float,
             told: Callable[[str, float], None]) -> dict:
    """Train each learner on the friction experiment and the open-loop training runs."""
    parts = [part for part in plan() if part.name in ('friction', 'open_loop_training')]
    recordings = recorded(work / 'bench', lambda name, ready, all_: told(
        f'recording {name}', 0.1 * ready / all_), parts)
    data = dataset_of(friction_of(data_sheet(), [
        r for group in recordings.values() for r in group]))
    known = names()
    done = {name: 0.1 + 0.9 * k / len(known) for k, name in enumerate(known)}

    def heard(name: str, epoch: int, loss: float, held: float) -> None:
        told(f'{name}, epoch {epoch}, validation {held:.4g}', done[name])

    rows, models = compared(data, known, seconds=seconds, told=heard)
    friction_speed(data, models, pictured / 'results_friction_speed.png')
    return {'table': markdown(rows), 'rows': plain(rows), 'best': best_of(rows).name,
            'limit': seconds,
            'samples': {part: len(getattr(data, part)) for part in (
                'train', 'validation', 'test', 'beyond')}}


def comparison_rows(found: Mapping) -> list[dict[str, str]]:
    """Return the row of docs/comparison.md from the figures of :func:`learners`."""
    rows = sorted(found['rows'], key=lambda row: row['test']['rmse'])
    best = rows[0]['test']
    others = ', '.join(f'{row["name"]} {row["test"]["r2"]:.3f}' for row in rows[1:])
    name, = (system.name for system in SYSTEMS if system.part == 'learners')
    return [{'system': name, 'runs': 'on the same rows, last fifth of each recording',
             'paper': 'names no torque sensor', 'command': '',
             'ours': f'{rows[0]["name"]} RMSE {best["rmse"]:.3f} N m, MAE {best["mae"]:.3f} N m, '
             f'R2 {best["r2"]:.4f}; R2 of the others {others}'}]
