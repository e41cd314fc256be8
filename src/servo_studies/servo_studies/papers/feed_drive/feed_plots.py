"""The pictures of the feed drive, as figures 14 to 16 of paper 001."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..results_plots import panels
from .feed_errors import Circle, Judged

COLOURS = {'measured': 'black', 'analytical': 'tab:green', 'hybrid': 'tab:red'}
MAGNIFIED = 500.0
THIN = 5  # one sample of so many is drawn


def errors(runs: Mapping[str, Judged], path: Path) -> None:
    """Draw the errors of both models over each sine (figure 14)."""
    columns = 3
    figure, axes = panels(-(-len(runs) // columns), columns, (12.6, 5.6))
    for ax, (name, run) in zip(axes.flat, runs.items(), strict=False):
        ax.axhline(0.0, color='0.6', lw=0.8)
        for model, place in run.predicted.items():
            ax.plot(run.time[::THIN], 1e6 * (place - run.measured)[::THIN], lw=0.9,
                    color=COLOURS[model], label=model)
        ax.set(title=name, ylim=(-11.0, 11.0))
    for ax in axes[:, 0]:
        ax.set_ylabel('model minus rig, um')
    for ax in axes[-1]:
        ax.set_xlabel('time, s')
    axes[0, 0].legend(fontsize=8, loc='upper right')
    figure.savefig(path)


def circles(found: Mapping[int, Circle], radius: float, path: Path) -> None:
    """Draw the circles in polar form, their errors magnified (figure 15)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.4, 10.4), dpi=75, layout='constrained')
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2, squeeze=False, subplot_kw={'projection': 'polar'})
    round_ = np.linspace(0.0, 2.0 * np.pi, 400)
    for ax, (turn, one) in zip(axes.flat, found.items(), strict=True):
        ax.plot(round_, np.full(400, 1e3 * radius), color='0.6', lw=1.0, label='wanted')
        for name in ('measured', 'analytical', 'hybrid'):
            ax.plot(one.angle[::THIN],
                    1e3 * (radius + MAGNIFIED * one.contour[name][::THIN]),
                    color=COLOURS[name], lw=1.8 if name == 'measured' else 0.9, label=name)
        ax.set_title(f'{turn} rad/min, errors x {MAGNIFIED:g}', fontsize=10)
        ax.set_rlim(0.0, 1e3 * radius + 12.0)
        ax.set_rlabel_position(60.0)
    axes[0, 0].legend(fontsize=8, loc='center')
    figure.savefig(path)


def contours(found: Mapping[int, Circle], path: Path) -> None:
    """Draw what both models are off by of the rig's contour error (figure 16)."""
    figure, axes = panels(2, 2, (11.0, 5.6))
    for ax, (turn, one) in zip(axes.flat, found.items(), strict=True):
        ax.axhline(0.0, color='0.6', lw=0.8)
        for model in ('analytical', 'hybrid'):
            gap = 1e6 * (one.contour[model] - one.contour['measured'])
            ax.plot(one.time[::THIN], gap[::THIN], lw=0.9, color=COLOURS[model], label=model)
        ax.set(title=f'{turn} rad/min', ylim=(-13.0, 13.0))
    for ax in axes[:, 0]:
        ax.set_ylabel('contour, model minus rig, um')
    for ax in axes[-1]:
        ax.set_xlabel('time, s')
    axes[0, 0].legend(fontsize=8)
    figure.savefig(path)
