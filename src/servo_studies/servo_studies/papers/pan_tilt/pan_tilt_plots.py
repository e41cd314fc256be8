"""The pictures of the pan-and-tilt, as figures 8 to 11 of paper 004, and more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from servo_identify.jobs.harmonic_drive_ranking import LINEAR, Ranked
from servo_identify.learn.free_run import EDGE, free_runs, FreeRun
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

COLOURS = ('tab:green', 'tab:red', 'tab:blue', 'tab:orange', 'tab:purple', 'tab:brown')
COUNTED = 5  # samples over which the counts of the motor encoder are differenced


def responses(servos: Mapping[str, Servo], recording: Recording, path: Path, title: str) -> None:
    """Draw the speed of the load: the rig's counts, and each servo's answer."""
    figure, (left, right) = _figure(1, 2, (11.0, 3.8))
    ratio = next(iter(servos.values())).values['mechanism.ratio']
    period = recording.period
    counted = np.zeros(len(recording))
    motor = recording['motor_position'] / ratio
    counted[COUNTED:] = (motor[COUNTED:] - motor[:-COUNTED]) / (COUNTED * period)
    time = np.arange(len(recording)) * period
    volts = recording['voltage']
    for axes in (left, right):
        axes.plot(time, counted, color='0.6', lw=0.6, label='rig, counts of the motor encoder')
        for (name, servo), colour in zip(servos.items(), COLOURS, strict=False):
            run = free_runs(servo, [recording])[0]
            axes.plot(time, run.predicted, color=colour, lw=1.3,
                      label=f'{name}, R = {run.speed_fit:.3f}')
        axes.set(xlabel='time, s', ylabel='speed of the load, rad/s')
    left.set_title(title)
    left.legend(fontsize=8)
    crossing = np.flatnonzero((volts[:-1] > 0.0) & (volts[1:] <= 0.0))
    middle = time[crossing[0]] if len(crossing) else time[np.argmax(volts > 0.0)] + 0.3
    right.set_xlim(middle - 0.8, middle + 1.6)
    if len(crossing):
        right.set_ylim(-0.8, 0.8)
    right.set_title('about the crossing of zero' if len(crossing) else 'the start')
    figure.savefig(path)


def ranking(order: Sequence[Ranked], path: Path) -> None:
    """Draw how much of the linear model's gap each model takes away, with its interval."""
    shown = [one for one in order if one.name != LINEAR and np.isfinite(one.gap)][::-1]
    figure, axes = _figure(1, 1, (7.5, 2.8))
    at = np.arange(len(shown))
    low, high = np.array([one.interval for one in shown]).T
    gone = np.array([one.shrink for one in shown])
    axes.barh(at, 100.0 * gone, color='tab:blue', height=0.6)
    axes.errorbar(100.0 * gone, at, xerr=100.0 * np.abs([gone - low, high - gone]), fmt='none',
                  ecolor='black', capsize=3)
    axes.set_yticks(at, [one.title for one in shown])
    axes.set(xlabel="of the linear model's gap gone, % (bars: 90 % over recordings)",
             xlim=(min(0.0, 100.0 * low.min()), 105.0))
    figure.savefig(path)


def loops(servos: Mapping[str, Servo], recording: Recording, path: Path) -> None:
    """Draw torque over torsion of a twisted output: the rig in grey, a panel a model."""
    figure, panels = _figure(2, 3, (11.0, 6.2), sharex=True, sharey=True)
    rows = slice(len(recording) // 2, None)
    for axes, (name, servo) in zip(np.ravel(panels), servos.items(), strict=False):
        ratio = servo.values['mechanism.ratio']
        wound = recording['motor_position'] / ratio - recording['load_position']
        axes.plot(_arcmin(wound[rows]), recording['torque'][rows], color='0.6', lw=0.8)
        y = free_runs(servo, [recording])[0].y
        axes.plot(_arcmin((y[:, 0] / ratio - y[:, 1])[rows]), y[rows, 2], color='tab:red', lw=0.9)
        axes.set_title(name, fontsize=9)
    for axes in panels[-1]:
        axes.set_xlabel('torsion, arcmin')
    for axes in panels[:, 0]:
        axes.set_ylabel('torque, N m')
    figure.savefig(path)


def axes(runs: Mapping[str, FreeRun], path: Path) -> None:
    """Draw the azimuth's speed over a nodding elevation, and what each twin is off."""
    figure, (top, low) = _figure(2, 1, (9.0, 5.4), sharex=True)
    for k, (name, run) in enumerate(runs.items()):
        time = (np.arange(len(run.measured)) * run.recording.period)[EDGE:-EDGE]
        if not k:
            top.plot(time, run.measured[EDGE:-EDGE], color='0.6', lw=2.0, label='rig')
            beside = top.twinx()
            beside.plot(time, np.degrees(run.recording['coupled_position'])[EDGE:-EDGE],
                        color='black', ls=':', lw=1.0)
            beside.set_ylabel('elevation, deg (dotted)')
        top.plot(time, run.predicted[EDGE:-EDGE], color=COLOURS[k], lw=1.0,
                 label=f'{name}, R = {run.speed_fit:.3f}')
        low.plot(time, (run.predicted - run.measured)[EDGE:-EDGE], color=COLOURS[k], lw=0.9)
    top.set_ylabel('azimuth, rad/s')
    top.legend(fontsize=8, loc='lower left')
    low.set(xlabel='time, s', ylabel='twin minus rig, rad/s')
    figure.savefig(path)


def _arcmin(angle: np.ndarray) -> np.ndarray:
    return np.degrees(angle - np.mean(angle)) * 60.0


def _figure(rows: int, columns: int, size: tuple[float, float], **shared):
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout='constrained', dpi=80)
    panels = figure.subplots(rows, columns, **shared)
    for one in np.ravel(panels):
        one.grid(alpha=0.3)
    return figure, panels
