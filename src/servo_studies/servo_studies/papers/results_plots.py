"""The pictures of the result, as figures 11 to 14 of paper 000."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from servo_identify.learn.free_run import FreeRun

from .model_errors import Course

COLOURS = {'measured': 'black', 'traditional': 'tab:green',
           'traditional + residual network': 'tab:orange', 'hybrid': 'tab:red'}
DEGREE = 180.0 / np.pi
SHOWN = (2.0, 6.0)  # s of an open-loop run
WHOLE, ZOOM = (3.0, 5.0), (4.35, 4.62)  # s of the velocity loop; about zero speed


def open_loop(runs: Mapping[str, Sequence[FreeRun]], names: Sequence[str], path: Path) -> None:
    """Draw speed and its error over time for some of the recordings (figure 11)."""
    figure, axes = panels(2, len(names), (6.2 * len(names), 6.0))
    order = {run.recording.name: k for k, run in enumerate(next(iter(runs.values())))}
    for column, name in enumerate(names):
        top, low = axes[0, column], axes[1, column]
        for k, (model, several) in enumerate(runs.items()):
            run = several[order[name]]
            time = np.arange(len(run.measured)) * run.recording.period
            rows = slice(*(int(t / run.recording.period) for t in SHOWN))
            if not k:
                top.plot(time[rows], DEGREE * run.measured[rows], lw=2.0, **_look('measured'))
            top.plot(time[rows], DEGREE * run.predicted[rows], lw=1.0, **_look(model))
            low.plot(time[rows], DEGREE * (run.predicted - run.measured)[rows], lw=1.0,
                     **_look(model, f'{model}, R = {run.speed_fit:.3f}'))
        top.set(title=name.replace('_', ' '), ylabel='speed, deg/s')
        low.set(xlabel='time, s', ylabel='twin minus rig, deg/s')
        low.legend(fontsize=8, loc='upper left')
        low.margins(y=0.25)
    axes[0, 0].legend(fontsize=8, loc='lower left')
    figure.savefig(path)


def velocity_loop(course: Course, path: Path) -> None:
    """Draw speed and error in the velocity loop, whole and near zero (figure 12)."""
    figure, axes = panels(2, 2, (12.4, 6.0))
    for column, window in enumerate((WHOLE, ZOOM)):
        rows = (course.time >= window[0]) & (course.time <= window[1])
        _lines(axes[0, column], course, rows, DEGREE)
        _errors(axes[1, column], course, rows, DEGREE)
        axes[0, column].set(ylabel='speed, deg/s')
        axes[1, column].set(xlabel='time, s', ylabel='twin minus rig, deg/s')
    axes[0, 0].set_title('10 deg/s at 1 Hz')
    axes[0, 1].set_title('in detail')
    axes[0, 1].legend(fontsize=8, loc='upper left')
    figure.savefig(path)


def torque(courses: Mapping[str, Course], path: Path) -> None:
    """Draw the motor torque over the turn, forward and reverse (figure 13)."""
    figure, axes = panels(1, len(courses), (6.2 * len(courses), 4.2))
    for ax, course in zip(axes[0], courses.values(), strict=True):
        _lines(ax, course, slice(None), 1.0)
        ax.set(xlabel='angle of the load, deg', ylabel='motor torque, N m', title=course.title)
    axes[0, 0].legend(fontsize=8)
    figure.savefig(path)


def reversals(courses: Sequence[Course], path: Path) -> None:
    """Draw angle and error about the turn-round of a ramp, one column a load (figure 14)."""
    figure, axes = panels(2, len(courses), (4.6 * len(courses), 6.0))
    for column, course in enumerate(courses):
        rows = slice(None)
        _lines(axes[0, column], course, rows, DEGREE)
        _errors(axes[1, column], course, rows, 60.0 * DEGREE)
        load = course.title.rpartition('_')[2]
        axes[0, column].set(ylabel='angle of the load, deg', title=f'{load} N m')
        axes[1, column].set(xlabel='time, s', ylabel='twin minus rig, arcmin')
    axes[0, 0].legend(fontsize=8, loc='lower center')
    figure.savefig(path)


def fits(table: Mapping[str, Sequence[float]], names: Sequence[str], path: Path) -> None:
    """Draw R of each of the sixteen recordings, one line a model."""
    figure, axes = panels(1, 1, (10.0, 4.4))
    ax = axes[0, 0]
    for model, values in table.items():
        ax.plot(range(len(names)), values, 'o-', ms=4, lw=1.0, **_look(model))
    ax.axhline(0.97, color='0.6', lw=0.8, ls='--')
    ax.set(ylabel='R of the speed (eq. 13)', xticks=range(len(names)))
    ax.set_xticklabels([n.replace('_', ' ') for n in names], rotation=60, ha='right', fontsize=8)
    ax.legend(fontsize=8)
    figure.savefig(path)


def _lines(ax, course: Course, rows, scale: float) -> None:
    ax.plot(course.time[rows], scale * course.measured[rows], lw=2.0, **_look('measured'))
    for model, values in course.predicted.items():
        ax.plot(course.time[rows], scale * values[rows], lw=1.0, **_look(model))


def _errors(ax, course: Course, rows, scale: float) -> None:
    ax.axhline(0.0, color='0.6', lw=0.8)
    for model, values in course.predicted.items():
        ax.plot(course.time[rows], scale * (values - course.measured)[rows], lw=1.0,
                **_look(model))


def _look(model: str, label: str | None = None) -> dict[str, str]:
    return {'color': COLOURS.get(model, '0.5'), 'label': label or model}


def panels(rows: int, columns: int, size: tuple[float, float]):
    """Return a figure of ``size`` inches and its axes, (rows, columns)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=100, layout='constrained')
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False)
