"""Every learner on the same rows: one table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import time

import numpy as np

from .dataset import Dataset
from .learners import learner
from .learners.model import Model
from .scores import Scores, scores_of


@dataclass(frozen=True)
class Row:
    """
    What one learner reached.

    ``test`` on the last part of each run, ``beyond`` at speeds faster than any it was trained on
    (None where there are none), both in N m; ``seconds`` of training, ``nanoseconds`` of one
    evaluation of the exported model.
    """

    name: str
    test: Scores
    beyond: Scores | None
    size: int
    seconds: float
    nanoseconds: float
    sentence: str


def compared(data: Dataset, names: Sequence[str], *, seed: int = 0, seconds: float = 60.0,
             told: Callable[[str, int, float, float], None] | None = None
             ) -> tuple[list[Row], dict[str, Model]]:
    """Train each learner for at most ``seconds`` and return the table and the models."""
    rows, models = [], {}
    for name in names:
        learn = learner(name)
        begun = time.perf_counter()
        model = learn(data, seed, seconds, _named(name, told))
        spent = time.perf_counter() - begun
        models[name] = model
        beyond = None
        if len(data.beyond):
            beyond = scores_of(data.target[data.beyond], model.predict(data, data.beyond))
        rows.append(Row(name, scores_of(data.target[data.test], model.predict(data, data.test)),
                        beyond, model.size, spent, _time_of(model), model.sentence))
    return rows, models


def _named(name: str, told):
    if told is None:
        return None
    return lambda epoch, loss, held: told(name, epoch, loss, held)


def _time_of(model: Model) -> float:
    """Return the shortest of several means of one evaluation, ns."""
    model.once()
    means = []
    for _ in range(5):
        begun = time.perf_counter_ns()
        for _ in range(200):
            model.once()
        means.append((time.perf_counter_ns() - begun) / 200.0)
    return float(min(means))


def markdown(rows: Sequence[Row]) -> str:
    """Return the table as Markdown."""
    lines = ['| learner | RMSE, N m | MAE, N m | R2 | RMSE beyond trained speeds, N m '
             '| parameters | training, s | evaluation, us | readable |',
             '|---|---|---|---|---|---|---|---|---|']
    for r in rows:
        far = f'{r.beyond.rmse:.4g}' if r.beyond else 'not measured'
        lines.append(f'| {r.name} | {r.test.rmse:.4g} | {r.test.mae:.4g} | {r.test.r2:.5f} '
                     f'| {far} | {r.size} | {r.seconds:.1f} | {r.nanoseconds / 1e3:.2f} | '
                     f'{r.sentence.replace("|", chr(92) + "|") or "no"} |')
    return '\n'.join(lines) + '\n'


def plain(rows: Sequence[Row]) -> list[dict]:
    """Return the table ready for JSON."""
    return [{**{k: getattr(r, k) for k in ('name', 'size', 'seconds', 'nanoseconds', 'sentence')},
             'test': vars(r.test), 'beyond': vars(r.beyond) if r.beyond else None} for r in rows]


def best_of(rows: Sequence[Row]) -> Row:
    """Return the row with the smallest test error."""
    return rows[int(np.argmin([r.test.rmse for r in rows]))]
