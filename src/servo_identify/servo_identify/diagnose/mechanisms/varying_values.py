"""Values of the servo file that vary: over time, temperature or speed, or by recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from servo_twin.physics.servo import Servo

from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import Motion
from ..residuals.nuisance import room_of, value_of
from ..residuals.samples import ResidualSamples
from .builder import Builder
from .by_recording import apart, between, names_of, repeated, with_changes, within_one
from .hypothesis import BY_RECORDING, Columns, Form, Hypothesis, Mechanism
from .orders import hats

VARYING = {
    'drive.gain': ('time', 'temperature'), 'drive.resistance': ('time', 'temperature'),
    'drive.torque_constant': ('time', 'temperature', 'speed'),
    'mechanism.stiffness': ('time', 'temperature'), 'mechanism.rotor_inertia': ('time',),
    'mechanism.load_inertia': ('time', 'speed')}
"""
Over what a value varies beside from recording to recording.

Machines warm up or pick something up. At speed flyweights move out, and a motor has less torque
by its current: its field is weakened, or turned from where the drive takes it to be.
"""

MOMENTS = {'time': 5, 'speed': 5, 'temperature': 2}
"""Of the range of a variable, between which such a value changes evenly."""
CHANGES = {('drive.torque_constant', 'speed'): 'torque_constant_change',
           ('drive.torque_constant', 'temperature'): 'torque_constant_change',
           ('drive.resistance', 'time'): 'winding_warmth'}
"""Effect that a value over a variable is handed over with; others get their mean."""
UNITS = {'time': 's', 'temperature': 'degC', 'speed': 'rad/s'}


def varying(builder: Builder, path: str, step: float, mechanism: Mechanism
            ) -> Iterator[Hypothesis]:
    """Yield the hypotheses that a value varies; ``step`` is that over which its slope is taken."""
    for variable in VARYING[path]:
        yield from filter(None, (_over(builder, path, step, mechanism, variable),))
    if repeated(builder):
        ways = (False, True) if 'time' in VARYING[path] else (False,)
        yield from filter(None, (_by_recording(builder, path, step, mechanism, changes)
                                 for changes in ways))


def _over(builder: Builder, path: str, step: float, mechanism: Mechanism, variable: str
          ) -> Hypothesis | None:
    samples = builder.samples
    every = [_along(one.motion, variable) for one in samples.errors]
    low, high = (edge(edge(one) for one in every) for edge in (min, max))
    if not high > low:
        return None
    knots = np.linspace(low if variable == 'temperature' else 0.0, high, MOMENTS[variable])
    at_rest = int(variable == 'speed')  # there the value is that of the file

    def shape(x: np.ndarray) -> np.ndarray:
        return hats(x, knots)[:, at_rest:]

    moments = len(knots) - at_rest
    table = _scaled(samples, path, step, moments,
                    lambda one, motion: shape(_along(motion, variable)))
    unit = dict(samples.servo.declarations())[path].unit
    law = CHANGES.get((path, variable))
    if path == 'drive.resistance' and samples.servo.drive.name != 'voltage_drive':
        law = None  # one that controls its current makes up for it
    form = Form(variable, UNITS[variable], unit, lambda one: _along(one.motion, variable), shape)
    return builder.hypothesis(
        replace(mechanism, variables=(*mechanism.variables, variable)), Columns(table),
        [int(variable != 'temperature')] * moments, tuple(knots[at_rest:]), either=True, form=form,
        room=room_of(samples, path),
        detail={'value': path, 'of': path, 'is': partial(value_of, samples, path)} | (
            {'law': law} if law else {}))


def _by_recording(builder: Builder, path: str, step: float, mechanism: Mechanism, changes: bool
                  ) -> Hypothesis | None:
    """A value that is another in each recording, and ``changes`` in it, as a winding warms up."""
    samples = builder.samples
    knots = [k for k in range(len(samples.errors)) for _ in range(1 + changes)]

    table = _scaled(samples, path, step, len(knots), lambda one, motion: apart(
        samples.errors, lambda _: with_changes(motion, np.ones(len(motion.time)), changes), one))
    return builder.hypothesis(
        replace(mechanism, variables=(BY_RECORDING,)), Columns(table), [0] * len(knots),
        tuple(knots),
        detail={'of': path, 'told': partial(_told, names_of(builder), partial(
            value_of, samples, path), path)})


def _told(names: Sequence[str], value: Callable[[float], float], path: str,
          knots: Sequence[int], amplitudes: np.ndarray, servo: Servo) -> str:
    """Return between what a value lies, in words, and how much it changes within a recording."""
    values = np.array([value(float(one)) for one in amplitudes])
    unit = servo.unit(path)
    said = between(names, knots, values, unit)
    if len(set(knots)) == len(knots):
        return said
    ends = (np.array([value(float(one)) for one in amplitudes[::2] + half * amplitudes[1::2]])
            for half in (0.5, -0.5))
    values[1::2] = next(ends) - next(ends)
    return said + within_one(knots, values, unit)


def _along(motion: Motion, variable: str) -> np.ndarray:
    """Return a variable at the inner samples of a motion."""
    if variable == 'time':
        return motion.time
    return np.abs(motion['motor_speed']) if variable == 'speed' else motion[variable]


def _scaled(samples: ResidualSamples, path: str, step: float, width: int,
            of: Callable[[EquationErrors, Motion], np.ndarray]) -> np.ndarray:
    """
    Return what a value does to all residuals, times a series of each recording: (samples, width).

    ``of(errors, motion)`` returns the series at the inner samples of the motion.
    """
    def columns(one: EquationErrors, name: str, change: np.ndarray) -> np.ndarray:
        motion = one.motion_of(name)
        return change[:, None] * motion.at_centres(of(one, motion), one.test(name))

    return samples.place({number: {name: columns(one, name, change)
                                   for name, change in one.slope(path, step).items()}
                          for number, one in enumerate(samples.errors)}, width)
