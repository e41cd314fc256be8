"""Blocks of joined samples: their columns, and what a twin takes of them."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan, nan
from types import SimpleNamespace

import numpy as np

from ..physics import state
from ..physics.servo import Servo
from ..physics.simulate import ROOM_TEMPERATURE
from ..physics.state import INPUTS
from .recording import COLUMNS

CHANNELS = tuple(COLUMNS)
"""Columns of a block of samples, in this order and SI units: those of a recording."""

MOTOR_POSITION, LOAD_POSITION, TORQUE = (
    CHANNELS.index(name) for name in ('motor_position', 'load_position', 'torque'))

_TAKEN = [CHANNELS.index(name) for name in INPUTS]
_MISSING = {state.VOLTAGE: 0.0, state.EXTERNAL: 0.0, state.COUPLED_POSITION: 0.0,
            state.TEMPERATURE: ROOM_TEMPERATURE}
_ELSE_ZERO = (state.REFERENCE_VELOCITY, state.REFERENCE_POSITION, state.ADDED_COMMAND)


def samples_of(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """Stack the columns of a recording to a block of samples, shape (samples, len(CHANNELS))."""
    return np.column_stack([np.asarray(columns[name], dtype=float) for name in CHANNELS])


def reference_of(servo: Servo) -> str | None:
    """Name the column without which a servo's controller says nothing; None: no controller."""
    if not servo.controller.parameters:
        return None
    said = servo.controller.law(control_values(servo), [0.0] * state.CONTROLLER_SIZE,
                                nan, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0)
    return 'reference_position' if isnan(said) else 'reference_velocity'


def control_values(servo: Servo) -> SimpleNamespace:
    """Return the values of a servo's controller by name, as its law takes them."""
    return SimpleNamespace(**{name: servo.values[f'controller.{name}']
                              for name in servo.controller.parameters})


class Inputs:
    """
    Makes the kernel's inputs of samples, remembering the last finite ones.

    A command, an external torque or a temperature that is not finite is held from the sample
    before (at first: zero, zero, room temperature); a reference and what is added to the command
    become zero.
    """

    def __init__(self) -> None:
        self._held = dict(_MISSING)

    def forget(self) -> None:
        """Hold nothing of the samples before: a value that broke the twin would break it again."""
        self._held = dict(_MISSING)

    def take(self, samples: np.ndarray, reference: str | None) -> tuple[np.ndarray, np.ndarray]:
        """
        Return inputs of shape (n, len(INPUTS)), and where the rig's loop is closed, bool (n,).

        ``samples`` has shape (n, len(CHANNELS)); ``reference`` as of :func:`reference_of`: the
        loop is closed where that column is finite.
        """
        u = samples.take(_TAKEN, axis=1)
        good = np.isfinite(u)
        if reference is None:
            looped = np.zeros(len(u), dtype=bool)
        else:
            looped = good[:, INPUTS.index(reference)]
        for column in _ELSE_ZERO:
            np.copyto(u[:, column], 0.0, where=~good[:, column])
        for column in _MISSING:
            self._held[column] = _hold(u[:, column], good[:, column], self._held[column])
        return u, looped


def _hold(column: np.ndarray, good: np.ndarray, last: float) -> float:
    """Put the last good value in place of those that are not, and return the last of all."""
    if not good.any():
        column[:] = last
    elif not good.all():
        where = np.maximum.accumulate(np.where(good, np.arange(len(column)), -1))
        column[:] = np.where(where < 0, last, column[where])
    return float(column[-1]) if len(column) else last
