"""What the controller of a servo makes of recorded references and readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from servo_twin.physics.kernel import fresh_state, kernel_of
from servo_twin.physics.servo import Servo

from .measured import Measured
from .motion import bridged
from .shown_current import between_rows, TURNS

Angles = tuple[np.ndarray, np.ndarray]
SMALL = 1e-3  # of a command, by which it is shaken to see whether it is at its limit


def commanded(servo: Servo, measured: Measured, theta: np.ndarray, angles: Angles,
              held: Mapping[str, np.ndarray], integral: float = 0.0, quick: bool = False,
              slope: Callable[[np.ndarray], np.ndarray] = np.gradient) -> np.ndarray:
    """
    Return the controller's output, V, at every sample; ``held`` stands for recorded references.

    ``integral`` V is what its integral begins with: in its sum it is as what is added.
    ``quick``: TURNS of its loop go to a row, and between rows all goes smoothly. A reference speed
    that was not recorded is that of the reference position, its ``slope`` by rows.
    """
    told = {name: held.get(name, measured.column(name, 0.0))
            for name in ('reference_position', 'reference_velocity', 'added_command')}
    told['added_command'] = told['added_command'] + integral
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


def integral_at_start(servo: Servo, measured: Measured, angles: Angles) -> float:
    """
    Return what the integral of a controller holds where a recording begins, V.

    A recording may begin while the loop holds a load. That is no matter of a constant alone: from
    another integral it meets the limit of the command at another time, and stands still there. It
    is that from which the output comes nearest to what was recorded.
    """
    if not servo.numbers.get('controller.ki'):
        return 0.0
    command = measured.column('voltage', 0.0)

    def off(integral: float) -> np.ndarray:
        return command - commanded(servo, measured, servo.theta, angles, {}, integral)

    step = SMALL * (float(np.nanstd(command)) or 1.0)
    start = float(np.nan_to_num(np.nanmedian(off(0.0))))
    if np.isclose(off(start) - off(start + step), step, rtol=0.1).all():
        return start  # it meets no limit
    most = float(np.nanmax(np.abs(command))) + abs(start)
    return float(minimize_scalar(
        lambda value: float(np.nanmean(np.abs(off(value)))), bounds=(-most, most),
        method='bounded', options={'xatol': step}).x)


def untold(servo: Servo, measured: Measured, angles: Angles, integral: float) -> np.ndarray:
    """
    Return by how much a controller may differ by what no row shows, V, at every sample.

    Its loop may be quicker than the rows, and a reference speed that was not recorded may be that
    since the last row. ``integral`` is that of :func:`commanded`.
    """
    of = partial(commanded, servo, measured, servo.theta, angles, {}, integral)
    known = of()
    apart = np.abs(of(quick=True) - known)
    if _speed_is_untold(measured):
        apart += np.abs(of(slope=lambda x: np.diff(x, prepend=x[:1])) - known)
    return apart


def _speed_is_untold(measured: Measured) -> bool:
    has = measured.recording.has
    return has('reference_position') and not has('reference_velocity')
