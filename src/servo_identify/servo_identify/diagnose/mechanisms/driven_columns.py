"""What a change of the command, or of the current that the drive makes of it, does to all."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..residuals.equation_errors import EquationErrors
from .builder import Builder
from .hypothesis import Columns


def through(builder: Builder, change: Callable[[EquationErrors], np.ndarray]) -> Columns:
    """
    Columns of changes of the command, V, as the drive turns them into current.

    ``change(errors)`` returns (samples, n).
    """
    def current(one: EquationErrors) -> np.ndarray:
        command, theta = one.regressor_command, one.servo.theta
        return np.column_stack([one.drive_current(theta, command + more) - one.driven_current
                                for more in change(one).T])

    return of_current(builder, current)


def of_current(builder: Builder, current: Callable[[EquationErrors], np.ndarray]) -> Columns:
    """Columns of changes of the current that the drive makes, A, (samples, n) at every sample."""
    known = {id(one): current(one) for one in builder.samples.errors}

    def unmeasured(one: EquationErrors) -> np.ndarray:
        measured = 'current' in one.measured.channels
        return np.zeros_like(known[id(one)]) if measured else known[id(one)]

    direct = builder.place('drive_current', lambda one: known[id(one)])
    driven = builder.place('current', unmeasured)
    return Columns(direct.table + driven.table, 'drive_current', current)
