"""Friction over speed and over angle, measured and learned."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from .friction_dataset import Dataset
from .learners.friction_learner import Model
from .servo_friction import LearnedFriction


def friction_speed(data: Dataset, models: Mapping[str, Model], path: Path) -> None:
    """Draw friction over speed: samples of the test part and each model's curve through them."""
    figure, axes = _figure()
    rows = data.test[::max(1, len(data.test) // 4000)]
    axes.plot(data.features[rows, 0], data.target[rows], '.', ms=1.5, color='0.7',
              label='measured')
    order = np.argsort(data.features[rows, 0])
    for name, model in models.items():
        predicted = model.predict(data, rows)[order]
        width = max(1, len(rows) // 150)
        cells = len(rows) // width * width
        mean = [v[:cells].reshape(-1, width).mean(axis=1)
                for v in (data.features[rows, 0][order], predicted)]
        axes.plot(*mean, lw=1.0, label=name)
    axes.set(xlabel='speed, rad/s', ylabel='friction, N m')
    axes.legend(fontsize=7, ncol=2)
    figure.savefig(path)


def friction_angle(learned: LearnedFriction, path: Path) -> None:
    """Draw friction over the angle at each speed, as figures 4 and 5 of paper 000."""
    from matplotlib import colormaps

    figure, axes = _figure(2)
    for ax, forward, network in zip(axes, (True, False), (learned.forward, learned.reverse),
                                    strict=True):
        table = learned.table[learned.table.forward == forward]
        grid = np.linspace(0.0, table.turn, 400)
        ladder = _ladder(table.speed)
        for colour, speed in zip(colormaps['viridis'](np.linspace(0.0, 0.9, len(ladder))), ladder,
                                 strict=True):
            mine = np.abs(table.speed - speed) < 0.05 * speed
            line, = ax.plot(grid, network(grid, np.full(400, speed)), lw=1.0,
                            color=colour, label=f'{speed:.3g} rad/s')
            ax.plot(table.angle[mine], table.torque[mine], '.', ms=1.5, color=line.get_color())
        ax.set(xlabel='angle, rad', ylabel='friction, N m',
               title='forward' if forward else 'reverse')
    axes[1].legend(fontsize=7, loc='center left', bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path)


def _ladder(speed: np.ndarray) -> list[float]:
    """Return the speeds that were held, one for each cluster."""
    ordered = np.sort(speed)
    cuts = np.flatnonzero(np.diff(ordered) > 0.05 * ordered[:-1]) + 1
    return [float(np.median(part)) for part in np.split(ordered, cuts)]


def _figure(columns: int = 1):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0 * columns, 4.0), dpi=110, layout='constrained')
    FigureCanvasAgg(figure)
    return figure, figure.subplots(1, columns)
