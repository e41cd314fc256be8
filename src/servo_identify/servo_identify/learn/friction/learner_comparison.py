"""Every learner on the same rows: one table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import time

import numpy as np

from ..error_scores import Scores, scores_of
from .friction_dataset import Dataset
from .learners import learner
from .learners.friction_learner import Model


@dataclass(frozen=True)
class Row:
    """
    What one learner reached.

    ``test`` on the last part of each run, ``beyond`` at speeds faster than any it was trained on,
    ``unseen`` on recordings that were kept back whole (None where there are none), all in N m;
    ``seconds`` of training, ``nanoseconds`` of one evaluation of the exported model, both of the
    processor, so that other work on the machine neither shortens a training nor slows a model.
    """

    name: str
    test: Scores
    beyond: Scores | None
    size: int
    seconds: float
    nanoseconds: float
    sentence: str
    unseen: Scores | None = None


def compared(data: Dataset, names: Sequence[str], *, seed: int = 0, seconds: float = 60.0,
             told: Callable[[str, int, float, float], None] | None = None
             ) -> tuple[list[Row], dict[str, Model]]:
    """Train each for at most ``seconds`` of the processor; return the table and the models."""
    rows, models = [], {}
    for name in names:
        learn = learner(name)
        begun = time.thread_time()
        model = learn(data, seed, seconds, _named(name, told))
        spent = time.thread_time() - begun
        models[name] = model
        test, beyond, unseen = (_scored(model, data, part) for part in (
            data.test, data.beyond, data.unseen))
        rows.append(Row(name, test, beyond, model.size, spent, _time_of(model), model.sentence,
                        unseen))
    return rows, models


def _scored(model: Model, data: Dataset, part: np.ndarray) -> Scores | None:
    return scores_of(data.target[part], model.predict(data, part)) if len(part) else None


def _named(name: str, told):
    if told is None:
        return None
    return lambda epoch, loss, held: told(name, epoch, loss, held)


def _time_of(model: Model) -> float:
    """Return the shortest of several means of one evaluation, ns."""
    model.once()
    means = []
    for _ in range(5):
        begun = time.thread_time_ns()
        for _ in range(200):
            model.once()
        means.append((time.thread_time_ns() - begun) / 200.0)
    return float(min(means))


def markdown(rows: Sequence[Row]) -> str:
    """Return the table as Markdown."""
    kept_back = any(r.unseen for r in rows)
    head = ['learner', 'RMSE, N m', 'MAE, N m', 'R2']
    if kept_back:
        head += [f'{what} unseen' for what in head[1:]]
    head += ['RMSE beyond trained speeds, N m', 'parameters', 'training, s', 'evaluation, us',
             'readable']
    lines = ['| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head)]
    for r in rows:
        cells = [r.name, *_cells(r.test), *(_cells(r.unseen) if kept_back else []),
                 f'{r.beyond.rmse:.4g}' if r.beyond else 'not measured', f'{r.size}',
                 f'{r.seconds:.1f}', f'{r.nanoseconds / 1e3:.2f}',
                 r.sentence.replace('|', chr(92) + '|') or 'no']
        lines.append('| ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines) + '\n'


def _cells(scores: Scores) -> list[str]:
    return [f'{scores.rmse:.4g}', f'{scores.mae:.4g}', f'{scores.r2:.5f}']


def plain(rows: Sequence[Row]) -> list[dict]:
    """Return the table ready for JSON."""
    return [{**{k: getattr(r, k) for k in ('name', 'size', 'seconds', 'nanoseconds', 'sentence')},
             **{part: vars(scores) if scores else None for part, scores in (
                 ('test', r.test), ('beyond', r.beyond), ('unseen', r.unseen))}} for r in rows]


def best_of(rows: Sequence[Row]) -> Row:
    """Return the row with the smallest error on unseen recordings, or else on the test part."""
    return rows[int(np.argmin([(r.unseen or r.test).rmse for r in rows]))]
