"""Pictures of the geared DC motor, as figures 1 to 3 of paper 003, and of its twin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from servo_identify.learn.free_run import FreeRun
from servo_identify.learn.friction.friction_dataset import Dataset
from servo_identify.learn.friction.learners.friction_learner import Model

from ..results_plots import panels

SHOWN = 6.0  # s of a recording
COLOURS = ('tab:red', 'tab:blue', 'tab:green', 'tab:orange')


def losses(course: Sequence[tuple[float, float]], name: str, path: Path) -> None:
    """Draw training and validation loss over the epochs (figure 1)."""
    figure, axes = panels(1, 1, (6.0, 3.6))
    for values, label in zip(zip(*course, strict=True), ('training', 'validation'), strict=True):
        axes[0, 0].semilogy(values, lw=1.2, label=label)
    axes[0, 0].set(xlabel='epoch', ylabel='mean square error, of the variance', title=name)
    axes[0, 0].legend(fontsize=8)
    figure.savefig(path)


def over_time(data: Dataset, models: Mapping[str, Model], runs: Mapping[str, int], path: Path
              ) -> None:
    """Draw friction by eq. 4 and as learned over time, one column for each of ``runs``."""
    figure, axes = panels(2, len(runs), (6.2 * len(runs), 5.4))
    for column, (title, run) in enumerate(runs.items()):
        rows = data.unseen[data.run[data.unseen] == run]
        rows = rows[len(rows) // 2:][:round(SHOWN / data.period)]
        time = (rows - rows[0]) * data.period
        axes[0, column].plot(time, data.features[rows, 0], lw=1.0, color='0.3')
        axes[1, column].plot(time, data.target[rows], lw=2.0, color='black', label='eq. 4')
        for colour, (name, model) in zip(COLOURS, models.items(), strict=False):
            axes[1, column].plot(time, model.predict(data, rows), lw=1.0, color=colour,
                                 label=name)
        axes[0, column].set(ylabel='speed, rad/s', title=title.replace('_', ' '))
        axes[1, column].set(xlabel='time, s', ylabel='friction, N m')
    axes[1, 0].legend(fontsize=8)
    figure.savefig(path)


def over_speed(data: Dataset, models: Mapping[str, Model], path: Path) -> None:
    """Draw friction over speed on the unseen recordings, one panel a learner (figure 3)."""
    figure, axes = panels(1, len(models), (5.0 * len(models), 4.0))
    rows = data.unseen
    for ax, colour, (name, model) in zip(axes[0], COLOURS, models.items(), strict=False):
        ax.plot(data.features[rows, 0], data.target[rows], '.', ms=1.5, color='0.7',
                label='eq. 4')
        ax.plot(data.features[rows, 0], model.predict(data, rows), '.', ms=1.5, color=colour,
                label=name)
        ax.set(xlabel='speed, rad/s', ylabel='friction, N m')
        ax.legend(fontsize=8, markerscale=5)
    figure.savefig(path)


def twin(runs: Mapping[str, Sequence[FreeRun]], chosen: Sequence[int], path: Path) -> None:
    """Draw the speed over time, rig and free runs of twins, of the recordings ``chosen``."""
    figure, axes = panels(1, len(chosen), (6.2 * len(chosen), 3.8))
    for ax, at in zip(axes[0], chosen, strict=True):
        for colour, (name, several) in zip(COLOURS, runs.items(), strict=False):
            run = several[at]
            time = np.arange(len(run.measured)) * run.recording.period
            rows = (time > 0.4 * time[-1]) & (time < 0.4 * time[-1] + SHOWN)
            if several is next(iter(runs.values())):
                ax.plot(time[rows], run.measured[rows], lw=2.0, color='black', label='rig')
            ax.plot(time[rows], run.predicted[rows], lw=1.0, color=colour,
                    label=f'{name}, R = {run.speed_fit:.3f}')
        ax.set(xlabel='time, s', ylabel='speed of the load, rad/s',
               title=run.recording.name.replace('_', ' '))
        ax.legend(fontsize=8)
    figure.savefig(path)
