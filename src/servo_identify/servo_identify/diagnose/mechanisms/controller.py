"""A controller that is another: its gains, all at once, or what it does to its references."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from servo_twin.physics.effect import Parameter
from servo_twin.physics.servo import Servo

from ..decisions import CALIBRATED, FORM, OPEN
from ..residuals.equation_errors import EquationErrors
from ..residuals.motion import shifted
from .builder import Builder
from .hypothesis import Columns, Hypothesis, Mechanism
from .memory import lagged
from .shape_search import best_shape, SHAPES
from .values import default_of

LATEST = 0.1  # of the longest recording, by which a reference may come late
SETTLING = 40  # evaluations of a controller in search of its gains
REFERENCES = ('reference_position', 'reference_velocity')


def controller_of(builder: Builder, residual: np.ndarray) -> Iterator[Hypothesis]:
    """
    The gains of the controller, all at once: a controller that is another.

    ``residual`` (samples,) is what is left within the tolerances; gains that have one are left to
    it.
    """
    samples, servo = builder.samples, builder.samples.servo
    if 'controller' not in samples.present:
        return
    yield from filter(None, (_fed_forward(builder),
                             _late(builder, residual, lagged, 'pass a lag of'),
                             _late(builder, residual, shifted, 'come late by')))
    gains = {path: parameter for path, parameter in servo.declarations()
             if path.startswith('controller.') and parameter.off is not None
             and path not in servo.tolerance}
    columns, slots, theta = [], samples.errors[0].slots, servo.theta.copy()
    there = samples.base
    found = _gains(builder, gains, residual)
    for path, value in found.items():
        given, parameter, moved = servo.numbers[path], gains[path], theta.copy()
        near = float(np.clip(1.25 * given or given + 0.1 * (abs(default_of(parameter)) or 1.0),
                             *parameter.bounds))
        moved[slots[path].start] = near if value == given else value
        after = samples.at(moved, only=('controller',))
        columns.append((after - there) / (moved[slots[path].start] - given or 1.0))
        if value != given:
            theta, there = moved, after
    if not columns:
        return
    mechanism = Mechanism('controller_mismatch', 'controller', 'controller', ('error',), 'odd',
                          memory=True)
    one = builder.hypothesis(mechanism, Columns(np.column_stack(columns)), [0] * len(columns),
                             tuple(found))
    if one:
        yield one


def _fed_forward(builder: Builder) -> Hypothesis | None:
    """What a firmware adds by the acceleration that its reference asks for."""
    told = any(one.measured.recording.has('reference_velocity') for one in builder.samples.errors)

    def rising(one: EquationErrors) -> np.ndarray:
        measured = one.measured
        speed = measured.column('reference_velocity', 0.0) if told else np.gradient(
            measured.column('reference_position', 0.0), measured.period)
        return np.gradient(speed, measured.period)[:, None]

    mechanism = Mechanism('controller_mismatch', 'controller', 'controller', ('acceleration',),
                          'odd')
    return builder.hypothesis(mechanism, builder.place('controller_output', rising), [0],
                              detail={'told': _feeds})


def _feeds(knots: Sequence[str], amplitudes: np.ndarray, servo: Servo) -> str:
    return (f'it adds {amplitudes[0]:.3g} V per {servo.reads("rad", "load")}/s2 of the '
            'acceleration of the reference')


def _late(builder: Builder, residual: np.ndarray,
          late: Callable[[np.ndarray, float, float], np.ndarray], words: str
          ) -> Hypothesis | None:
    """A firmware that smooths its references or takes them over late."""
    def change(one: EquationErrors, time: float) -> np.ndarray:
        measured = one.measured
        held = {name: late(measured.column(name, 0.0), time, measured.period)
                for name in REFERENCES if measured.recording.has(name)}
        now = one.controller_output(one.servo.theta, held=held)
        return (now - one.controller_output(one.servo.theta))[:, None]

    def column(time: float) -> np.ndarray:
        return builder.place('controller_output', lambda one: change(one, time)).table[:, 0]

    period = builder.scales.period
    time = best_shape(period, max(LATEST * builder.scales.duration, 2.0 * period), column,
                      residual, whole=True)
    mechanism = Mechanism('controller_mismatch', 'controller', 'controller', ('time',), 'odd',
                          memory=True)
    return builder.hypothesis(mechanism, builder.place(
        'controller_output', lambda one: change(one, time)), [1], (time,), tried=SHAPES,
        detail={'told': partial(_delays, words)})


def _delays(words: str, knots: Sequence[float], amplitudes: np.ndarray, servo: Servo) -> str:
    return f'its references {words} {knots[0]:.3g} s'


def _gains(builder: Builder, gains: Mapping[str, Parameter],
           residual: np.ndarray) -> dict[str, float]:
    """
    Return the gains that leave least of the controller's equation, by path.

    A filter or an integral that is far from the file's does no multiple of what a little of it
    does. Gains that make up for each other are as few as leave no more; the others are those of
    the file. All are, where the equation is not certainly off. Beside each what may move without a
    fault is free.
    """
    samples = builder.samples
    given, rows = samples.servo.numbers, samples.rows('controller')
    known = {path: given[path] for path in gains}
    if not gains or not np.mean(residual[rows]**2) > OPEN**2:
        return known
    slots, of = samples.errors[0].slots, samples.recording[rows]
    count = np.maximum(np.bincount(of), 1)
    period = samples.errors[0].measured.period  # of a filter of no time a little does nothing

    def settled(free: Sequence[str], start: Mapping[str, float]) -> tuple[float, dict[str, float]]:
        """Return what the best values of some gains leave, in mean squares, and these values."""
        def left(values: np.ndarray) -> np.ndarray:
            theta = samples.servo.theta.copy()
            for path, value in zip(free, values, strict=True):
                theta[slots[path].start] = value
            change = samples.at(theta, only=('controller',)) - samples.base
            error = builder.apart(residual + change)[rows]
            return error - (np.bincount(of, error) / count)[of]  # an integral begins anywhere

        low, high = (np.array([gains[path].bounds[k] for path in free]) for k in (0, 1))
        first = np.array([start[path] or (period if gains[path].unit == 's' else abs(
            default_of(gains[path])) or 1.0) for path in free])
        best = least_squares(left, np.clip(first, low, high), bounds=(low, high), x_scale='jac',
                             max_nfev=SETTLING)
        return 2.0 * float(best.cost) / max(len(of), 1), dict(
            zip(free, map(float, best.x), strict=True))

    least, every = settled(list(gains), known)
    found: dict[str, float] = {}
    while len(found) + 1 < len(gains):
        square, found = min((settled([*found, path], known | found) for path in gains
                             if path not in found), key=lambda one: one[0])
        if square <= max(CALIBRATED, (1.0 + FORM**2) * least):
            return found
    return every
