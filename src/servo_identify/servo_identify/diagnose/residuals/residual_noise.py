"""What the noise of the readings does to the residual of an equation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from servo_twin.balances.equation_terms import Term

from .equation_errors import EquationErrors
from .test_function import taps


def signal_of(one: EquationErrors, equation: str, theta: np.ndarray, keep: np.ndarray) -> float:
    """Root mean square of the largest term of an equation: what its residual is small against."""
    motion = one.motion_of(equation)
    if equation == 'transmission':
        twist = motion['torsion'] if 'torsion' in motion.__dict__ else motion['wind_up']
        return float(np.std(twist))
    if equation == 'drive':
        size = one.measured.recording['current']
    elif equation == 'controller':
        size = one.measured.recording['voltage']
    elif equation == 'load':
        size = one.measured.recording['torque']
    else:
        current = (one.measured.recording['current'] if 'current' in one.measured.channels
                   else one.drive_current(theta))
        constant = theta[one.slots['drive.torque_constant'].start]
        lever = theta[one.slots['mechanism.ratio'].start] if equation == 'torque' else 1.0
        size = current * constant * lever
    size = size[np.isfinite(size)]
    return float(np.sqrt(np.mean(size**2))) if len(size) else 0.0


class Propagated(NamedTuple):
    """
    What noise of the readings does to a residual, in the unit of the equation.

    ``std`` by what the readings show; ``alike`` the correlation of neighbouring samples, and of
    those two apart. ``declared``: the most that noise of the size in the servo file may do.
    Readings show what changes from row to row; noise that has passed a filter changes slowly.
    """

    std: float
    alike: tuple[float, float]
    declared: float


def propagated_noise(one: EquationErrors, equation: str, theta: np.ndarray) -> Propagated:
    """
    Return what the noise of the readings does to a residual.

    Quantities that follow from a reading (the other shaft of one encoder, the current of a
    command) are followed back.
    """
    measured, test = one.measured, one.test(equation)
    noise = {name: 0.0 if np.isnan(size) else size for name, size in measured.noise.items()}
    noise['voltage'] = float(np.nan_to_num(one.servo.noise('voltage')))
    if equation == 'controller':
        controllers = _controller_noise(one, theta, noise)
        return Propagated(controllers, (0.0, 0.0), controllers)
    ratio = one.servo.numbers['mechanism.ratio']
    passed: dict[str, np.ndarray] = {}

    def take(signal: str, order: int, factor: float) -> None:
        shape = taps(test.spacing, order) * ((-1.0) ** order / test.period ** order) * factor
        passed[signal] = passed.get(signal, 0.0) + shape

    for term in one._terms(theta)[equation]:
        for signal, order, factor in _readings_of(term, one, theta, ratio):
            take(signal, order, factor)
    power, most, shifted = 0.0, 0.0, np.zeros(2)
    for signal, shape in passed.items():
        size = noise.get(signal, 0.0) ** 2
        power += size * float(shape @ shape)
        declared = float(np.nan_to_num(one.servo.noise(signal)))
        most += max(size * float(shape @ shape), (declared * float(shape.sum())) ** 2)
        for k in (1, 2):
            lag = k * test.stride
            if lag < len(shape):
                shifted[k - 1] += size * float(shape[lag:] @ shape[:-lag])
    alike = shifted / power if power > 0.0 else np.zeros(2)
    return Propagated(float(np.sqrt(power)), (float(alike[0]), float(alike[1])),
                      float(np.sqrt(most)))


def _readings_of(term: Term, one: EquationErrors, theta: np.ndarray, ratio: float
                 ) -> Iterator[tuple[str, int, float]]:
    """Yield (reading, order, factor) of a term: what is derived is followed to its readings."""
    channels = one.measured.channels
    if term.signal == 'motor_position' and term.signal not in channels:
        yield 'load_position', term.order, term.factor * ratio
    elif term.signal == 'load_position' and term.signal not in channels:
        yield 'motor_position', term.order, term.factor / ratio
    elif term.signal in ('drive_current', 'current') and (
            term.signal == 'drive_current' or 'current' not in channels):
        values = {p: theta[s.start] for p, s in one.slots.items() if p.startswith('drive.')}
        resistance = values.get('drive.resistance', 0.0) + values.get('drive.proportional', 0.0)
        gain = values.get('drive.gain', 0.0) * (values.get('drive.proportional') or 1.0)
        yield 'voltage', term.order, term.factor * gain / (resistance or 1.0)
        if resistance:
            back = -term.factor * values.get('drive.back_emf', 0.0) / resistance
            shaft = 'motor_position' in channels
            yield ('motor_position' if shaft else 'load_position', term.order + 1,
                   back * (1.0 if shaft else ratio))
    elif term.signal in channels:
        yield term.signal, term.order, term.factor


def _controller_noise(one: EquationErrors, theta: np.ndarray, noise: Mapping[str, float]) -> float:
    """Standard deviation of the controller's residual by the noise of the encoders, V."""
    chance = np.random.default_rng(0)
    angles = one.angles()
    ratio = one.servo.numbers['mechanism.ratio']
    has = one.measured.channels
    shake = [chance.normal(0.0, noise[name], len(angle)) if name in has else None
             for name, angle in zip(('motor_position', 'load_position'), angles, strict=True)]
    motor, load = shake
    if motor is None and load is not None:
        motor = load * ratio
    elif load is None and motor is not None:
        load = motor / ratio
    shaken = one.controller_output(theta, shaken=(angles[0] + motor, angles[1] + load))
    change = one.test('controller').project(shaken - one.controller_output(theta))
    return float(np.hypot(np.nanstd(change),
                          noise['voltage'] * one.test('controller').gain(0)))
