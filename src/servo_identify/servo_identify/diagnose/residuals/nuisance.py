"""What may move without anything being at fault: tolerances, zeros, settings, instants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..decisions import SAMPLING
from .equation_errors import EquationErrors
from .samples import ResidualSamples
from .sampling_instants import late_channels, sampling_columns

ACTS = (-1.1, 0.6)  # sample periods: a command acts with the next row, or is seen in passing
READ = (-0.6, 1.1)  # of a current against its command: it is read before that acts, or after
STEPPED = (-0.5, 0.5)  # of the jump by which a current is read after or before it, from its mean
BETWEEN = (-1.0, 1.0)  # of the same: a current is read before, after or in the mean of its row
MOVING = (0.0, 1.0)  # of a command that goes straight between rows: the loop may be quicker
STEP = 0.25  # share of a tolerance over which a slope is taken
FINE = 1e-3  # share of a ratio over which its slope is taken: its error adds up over the travel
FAR = 10.0  # times by which a value of a data sheet may be off
FILTER = 'controller.filter'
UNTOLD = ('sensors', 'observer')  # sections whose values move no residual


@dataclass(frozen=True)
class Nuisance:
    """
    Columns of the regression that are always in it.

    ``labels`` name them: the path of a value (``PATH:n`` for recording n alone), or ``zero:n``,
    ``integral:n``, ``late:CHANNEL``, ``discrete:PATH``.
    ``columns`` has shape (samples, n) for one unit each, within ``low`` and ``high`` about the
    servo as given.
    """

    labels: tuple[str, ...]
    columns: np.ndarray
    low: np.ndarray
    high: np.ndarray


def nuisance_of(samples: ResidualSamples) -> Nuisance:
    """Return the nuisance columns of a regression."""
    servo = samples.servo
    labels, columns, low, high = [], [], [], []

    def put(label: str, column: np.ndarray, bounds: tuple[float, float]) -> None:
        if np.abs(column).max(initial=0.0) > 0.0:
            labels.append(label)
            columns.append(column)
            low.append(bounds[0])
            high.append(bounds[1])

    for path, (least, most) in servo.tolerance.items():
        if path.split('.')[0] in UNTOLD or most <= least:
            continue
        column = slope(samples, path, STEP * (most - least), (least, most))
        bounds = amplitude_of(samples, path, least), amplitude_of(samples, path, most)
        if path.startswith('controller.'):
            for number in range(len(samples.errors)):  # gains are settings of each recording
                put(f'{path}:{number}', np.where(samples.recording == number, column, 0.0),
                    bounds)
        else:
            put(path, column, bounds)
    stepped = _stepped(samples)
    if stepped is not None:  # exact for the differences that are further from the file
        put(f'discrete:{FILTER}', slope(samples, FILTER, max(stepped, key=abs), (0.0, np.inf)),
            stepped)
    measured = any('current' in one.measured.channels for one in samples.errors)
    late = samples.place(sampling_columns(samples.errors))
    for channel, column in zip(late_channels(samples.errors), late.T, strict=True):
        put(f'late:{channel}', column,
            (-SAMPLING, SAMPLING) if channel != 'drive' else READ if measured else ACTS)
    for label, of, bounds in (('reference', EquationErrors.current_stepped, STEPPED),
                              ('current between rows', EquationErrors.current_between, BETWEEN)):
        known = {number: one.of_signal('current', series) for number, one in enumerate(
            samples.errors) for series in [of(one)] if series is not None}
        put(f'late:{label}', samples.place({  # the drive is held against the reading as it is
            number: {name: column for name, column in several.items() if name != 'drive'}
            for number, several in known.items()}, 1)[:, 0], bounds)
    moving = {number: one.of_signal('drive_current', series) for number, one in enumerate(
        samples.errors) for series in [one.current_moving()] if series is not None}
    put('late:command between rows', samples.place(moving, 1)[:, 0], MOVING)
    for number, one in enumerate(samples.errors):
        for label, equation in (('zero', 'transmission'), ('integral', 'controller')):
            if equation in one.equations and (
                    label == 'zero' or servo.values.get('controller.ki')):
                constant = {equation: np.ones(len(one.times(equation)))}
                put(f'{label}:{number}', samples.place({number: constant})[:, 0],
                    (-np.inf, np.inf))
    table = np.column_stack(columns) if columns else np.zeros((len(samples.base), 0))
    return Nuisance(tuple(labels), table, np.array(low), np.array(high))


def _stepped(samples: ResidualSamples) -> tuple[float, float] | None:
    """
    Return by how much the filter of the controller acts as another one as firmware steps it, s.

    Less by forward and more by backward differences, of which a servo file says nothing: the twin
    steps it exactly. None where there is no filter, or its tolerance says how far it may be off.
    """
    servo, period = samples.servo, samples.errors[0].measured.period
    time = servo.numbers.get(FILTER, 0.0)
    if not time > 0.0 or FILTER in servo.tolerance:
        return None
    forward = -period / np.log1p(-period / time) if period < time else 0.0
    return float(forward - time), float(period / np.log1p(period / time) - time)


def untold_ratio(samples: ResidualSamples) -> float:
    """
    Return by how much another ratio is none that two encoders tell.

    The graduation of an encoder is true to a count, at either end of the travel. Noise stands for
    a count where none is seen. Zero where the transmission has no equation.
    """
    ratio, shares = samples.servo.numbers['mechanism.ratio'], []
    if 'transmission' not in samples.present:
        return 0.0
    for one in samples.errors:
        noise = one.measured.noise
        count = np.sqrt(12.0) * (noise['load_position'] + noise['motor_position'] / ratio)
        travel = float(np.ptp(one.motion['load_angle'])) if len(one.motion.rows) else 0.0
        shares.append(2.0 * count / travel if travel > 0.0 else np.inf)
    return ratio * float(min((one for one in shares if np.isfinite(one)), default=0.0))


def slope(samples: ResidualSamples, path: str, step: float,
          bounds: tuple[float, float]) -> np.ndarray:
    """Return the change of all residuals for one unit of a value, by a step within its bounds."""
    value = samples.servo.number(path)
    if not bounds[0] <= value + step <= bounds[1]:
        step = -step
    step = float(np.clip(value + step, *bounds)) - value
    if step == 0.0:
        return np.zeros(len(samples.base))
    return samples.place({number: one.slope(path, step)
                          for number, one in enumerate(samples.errors)}, 1)[:, 0]


def amplitude_of(samples: ResidualSamples, path: str, value: float) -> float:
    """Return what stands before the column of a value of the file where it is another one."""
    given = samples.servo.number(path)
    if _scales(samples, path) and value * given > 0.0:
        return given * (1.0 - given / value)
    return value - given


def room_of(samples: ResidualSamples, path: str, bounds: tuple[float, float] = (-np.inf, np.inf)
            ) -> tuple[float, float]:
    """
    Return between what the column of a value may count: within ``bounds``.

    A value of drive or mechanism is off by a factor FAR at most: no inertia is negative, and no
    gain turns round or vanishes to be made up for by another.
    """
    given, (least, most) = samples.servo.numbers[path], bounds
    if given != 0.0 and not path.startswith('effects.'):
        ends = sorted((given / FAR, given * FAR))
        least, most = max(least, ends[0]), min(most, ends[1])
    return amplitude_of(samples, path, least), amplitude_of(samples, path, most)


def value_of(samples: ResidualSamples, path: str, amplitude: float) -> float:
    """Return the value that an amplitude of its column stands for."""
    given = samples.servo.number(path)
    if _scales(samples, path) and amplitude * given < given**2:
        return given / (1.0 - amplitude / given)
    return given + amplitude


def _scales(samples: ResidualSamples, path: str) -> bool:
    """
    Tell whether a value divides what the other terms explain.

    The column is what the motion asks for, so that its amplitude is that of the reciprocal: half
    the torque constant asks for twice the current, half the stiffness for twice the torsion. Where
    the current is measured, a command drives twice as much through half the resistance.
    """
    sensed = any('current' in one.measured.channels for one in samples.errors)
    return path in ('drive.torque_constant', 'mechanism.stiffness') or (
        path == ('drive.resistance' if sensed else 'drive.gain'))
