"""The variables that mechanisms depend on, along the motion of one recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..residuals.equation_errors import EquationErrors


@dataclass(frozen=True)
class Variable:
    """
    A quantity along a measured motion.

    ``of(errors)`` returns it at the inner samples, in ``unit``. ``signed``: its own sign makes a
    pattern over it odd; patterns over other variables are odd by the direction of motion.
    """

    name: str
    unit: str
    of: Callable[[EquationErrors], np.ndarray]
    signed: bool = False

    def sized(self, one: EquationErrors) -> np.ndarray:
        """Return its size, without the sign of a signed one."""
        return np.abs(self.of(one)) if self.signed else self.of(one)

    def way(self, one: EquationErrors) -> np.ndarray:
        """Return what makes a pattern over it odd."""
        return np.sign(self.of(one)) if self.signed else one.motion.direction


def variables_of(equation: str) -> tuple[Variable, ...]:
    """Return the variables by which an equation may have a pattern."""
    shaft = 'motor' if equation in ('motor', 'drive') else 'load'
    twisting = equation == 'transmission'
    several = (
        Variable('speed', 'rad/s', lambda one: np.abs(one.motion[f'{shaft}_speed'])),
        Variable('angle', 'rad', lambda one: one.motion[
            'driven_angle' if twisting else 'load_angle']),
        Variable('load', 'N m', lambda one: np.abs(
            one.transmitted() if twisting else one.predicted_load)),
        Variable('acceleration', 'rad/s2', lambda one: one.motion['load_acceleration'], True),
        Variable('current', 'A', lambda one: (
            one.predicted_current if equation == 'drive' else one.driving_current), True),
        Variable('travel since reversal', 'rad', lambda one: one.motion.travel),
        Variable('time', 's', lambda one: one.motion.time),
        Variable('temperature', 'degC', lambda one: one.motion['temperature']))
    if equation != 'drive':
        return several
    return (*several, Variable('command', 'V', _command, True))


def _command(one: EquationErrors) -> np.ndarray:
    return one.inner(one.measured.column('voltage', 0.0))
