"""What switching the inverter edge by edge changes, beside its average."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import initial_state, simulate

from ..results_plots import panels
from ..step_time import driven, stepped

PERIOD = 1e-3
PARTS = 16  # of a cycle of the current loops
FROM, SHOWN = 0.9, 0.25e-3  # s: where in the run the cycles are that are looked at, how long


def inverter_figures(servo: Servo, reference: np.ndarray, picture: Path) -> dict[str, float]:
    """
    Return and draw what becomes of table, current and time where the inverter switches.

    ``reference`` (samples,), m, is followed in the closed loop, once a millisecond.
    """
    switching = servo.with_values({'drive.switching': 1.0})
    u = driven(reference_position=reference)
    answers, taken = {}, {}
    for name, one in (('averaged', servo), ('switching', switching)):
        answers[name], taken[name] = stepped(one, u, PERIOD, 'closed_loop')
    commands = answers['averaged'][:, 4]
    currents = {name: _within(one, commands) for name, one in (
        ('averaged', servo), ('switching', switching))}
    cycles = currents['switching'][:len(currents['switching']) // PARTS * PARTS]
    _draw(currents, servo.values['drive.current_cycle'] / PARTS, picture)
    apart = answers['switching'][:, 1] - answers['averaged'][:, 1]
    return {'apart': 1e9 * float(np.max(np.abs(apart))),
            'ripple': float(np.max(np.ptp(cycles.reshape(-1, PARTS), axis=1))),
            'step_averaged': taken['averaged'], 'step_switching': taken['switching']}


def _within(servo: Servo, commands: np.ndarray) -> np.ndarray:
    """Return the current within cycles of the current loop, under commands held for a sample."""
    period = servo.values['drive.current_cycle'] / PARTS
    begin = round(FROM / PERIOD)
    x = initial_state(servo)
    simulate(servo, driven(voltage=commands[:begin]), PERIOD, x)
    held = np.full(round(SHOWN / period), commands[begin])
    return simulate(servo, driven(voltage=held), period, x)[:, 3]


def _draw(currents: dict[str, np.ndarray], period: float, path: Path) -> None:
    figure, axes = panels(1, 1, (8.0, 3.2))
    ax = axes[0, 0]
    for name, colour in (('switching', 'tab:blue'), ('averaged', 'tab:red')):
        at = 1e6 * period * np.arange(len(currents[name]))
        ax.plot(at, currents[name], lw=1.2, color=colour, label=f'{name} inverter')
    ax.set(xlabel='time, us', ylabel='q current, A')
    ax.legend(fontsize=8)
    figure.savefig(path)
