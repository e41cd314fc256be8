"""What the controller of a servo makes of recorded references and readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline

from servo_twin.physics.kernel import fresh_state, kernel_of
from servo_twin.physics.servo import Servo

from .driven_current import between_rows, TURNS
from .measured import Measured
from .motion import bridged

Angles = tuple[np.ndarray, np.ndarray]


def commanded(servo: Servo, measured: Measured, theta: np.ndarray, angles: Angles,
              held: Mapping[str, np.ndarray], quick: bool = False,
              slope: Callable[[np.ndarray], np.ndarray] = np.gradient) -> np.ndarray:
    """
    Return the controller's output, V, at every sample; ``held`` stands for recorded references.

    ``quick``: TURNS of its loop go to a row, and between rows all goes smoothly. A reference speed
    that was not recorded is that of the reference position, its ``slope`` by rows.
    """
    told = {name: held.get(name, measured.column(name, 0.0))
            for name in ('reference_position', 'reference_velocity', 'added_command')}
    if _speed_is_untold(measured):
        told['reference_velocity'] = slope(told['reference_position']) / measured.period
    series, turns = [*told.values(), *angles], TURNS if quick else 1
    if quick:
        rows, fine = np.arange(len(series[0])), between_rows(len(series[0]))
        series = [CubicSpline(rows, bridged(one))(fine) for one in series]
    *references, motor, load = series
    kernel, command = kernel_of(servo), np.empty(len(motor))
    kernel.controller_output(theta, servo.switches, fresh_state(kernel),
                             np.column_stack(references), motor, load, command,
                             measured.period / turns)
    return command[::turns]


def untold(servo: Servo, measured: Measured, angles: Angles) -> np.ndarray:
    """
    Return by how much a controller may differ by what no row shows, V, at every sample.

    Its loop may be quicker than the rows, and a reference speed that was not recorded may be that
    since the last row.
    """
    of = partial(commanded, servo, measured, servo.theta, angles, {})
    known = of()
    apart = np.abs(of(quick=True) - known)
    if _speed_is_untold(measured):
        apart += np.abs(of(slope=lambda x: np.diff(x, prepend=x[:1])) - known)
    return apart


def _speed_is_untold(measured: Measured) -> bool:
    has = measured.recording.has
    return has('reference_position') and not has('reference_velocity')
