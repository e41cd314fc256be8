"""
Which formula of the catalogue a measured curve is, if any, and the flexible effect where none is.

A law is accepted where it stays within the band of the curve, or within the share by which the
form of any law may be off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import inf

import numpy as np
from scipy.optimize import least_squares

from servo_twin.physics.catalogue import find, names
from servo_twin.physics.effect import Effect
from servo_twin.physics.servo import Servo, Value
from servo_twin.physics.spline import spline, turning

from ..decisions import FORM
from ..mechanisms.hypothesis import Mechanism, TURN
from .curves import Curve, Part, POINTS

COEFFICIENTS, AROUND = 8, 12  # of a spline over an interval, and over a turn
PASSED = 0.9  # share of a turn from which a curve over the angle repeats
STARTS = (0.05, 0.2, 0.6)  # shares of the range of the variable from which a shape is sought
FIXED = ('order', 'reference', 'exponent', 'regain')
"""Shapes that a curve hardly tells: their default holds."""

MOST_MULTIPLES = 8  # of a base order in one effect

SEEN = {'speed': 'speed', 'load': 'torque', 'angle': 'angle', 'time': 'time',
        'current': 'current', 'command': 'value'}
"""Which column of what a port shows is the variable of a curve."""

FLEXIBLE = {
    ('friction', 'speed'): 'friction_over_speed', ('friction', 'load'): 'friction_over_load',
    ('friction', 'angle'): 'friction_over_angle', ('friction', 'time'): 'friction_over_time',
    ('torque', 'angle'): 'torque_over_angle', ('torque', 'current'): 'torque_over_current',
    ('clearance', 'load'): 'clearance_over_load', ('clearance', 'angle'): 'clearance_over_angle',
    ('mesh_error', 'angle'): 'error_over_angle', ('mesh', 'load'): 'elasticity_over_torsion',
    ('drive', 'command'): 'drive_over_command'}
"""The flexible effect of a port over a variable."""


@dataclass(frozen=True)
class Formed:
    """
    An effect that has the form of a curve: its values and which of them a fit may move.

    ``law`` whether it is that of the catalogue and lies within the band of the curve; ``holds``
    the share of the squares of the curve that it has.
    """

    effect: type[Effect]
    values: dict[str, float | tuple[float, ...]]
    free: tuple[str, ...]
    law: bool
    holds: float = 1.0


def formed(part: Part, servo: Servo, stiffness: float = inf) -> Formed | None:
    """
    Return the effect of the twin that a part of the answer is; None where none or a flat curve is.

    The law of the catalogue where the curve lies within its band, else the flexible effect.
    ``stiffness`` (N m/rad) turns a lost angle into a torque of the transmission.
    """
    if part.curve is None or not part.curve.size():
        return None
    law = lawful(part, servo, stiffness)
    flexible = FLEXIBLE.get((part.mechanism.port, part.curve.variable))
    if flexible is None or law is not None and law.law:
        return law
    return _spline(find(flexible), _at_its_port(part.mechanism, part.curve, servo, stiffness),
                   _turns(part.mechanism, servo))


def lawful(part: Part, servo: Servo, stiffness: float = inf) -> Formed | None:
    """Return the law of the catalogue that is nearest to a curve; None where there is none."""
    if part.curve is None or part.mechanism.name not in names():
        return None
    if not _turns(part.mechanism, servo) and part.curve.variable == 'angle' and (
            'order' in find(part.mechanism.name).parameters):
        return None
    return _fitted(find(part.mechanism.name),
                   _at_its_port(part.mechanism, part.curve, servo, stiffness))


def _turns(mechanism: Mechanism, servo: Servo) -> bool:
    """Whether what a mechanism acts on turns."""
    return not servo.linear or mechanism.site == 'motor'


def _at_its_port(mechanism: Mechanism, curve: Curve, servo: Servo, stiffness: float) -> Curve:
    """Return a curve over what its port sees: the torsion, and a load at the motor's shaft."""
    if mechanism.port == 'mesh':
        curve = over_torsion(curve, stiffness)
    lever = servo.numbers['mechanism.ratio'] if mechanism.site == 'motor' else 1.0
    if curve.variable == 'load' and lever != 1.0:
        curve = replace(curve, x=curve.x / lever)
    return curve


def over_torsion(curve: Curve, stiffness: float) -> Curve:
    """
    Return the torque that a transmission lacks over its torsion, from the angle lost over torque.

    An angle ``d`` lost at the torque T is the torque -K d at the torsion T / K + d.
    """
    torsion = curve.x / stiffness + curve.y
    order = np.argsort(torsion)
    even = np.linspace(torsion.min(), torsion.max(), len(torsion))

    def at(y: np.ndarray) -> np.ndarray:
        return np.interp(even, torsion[order], -stiffness * y[order])

    low, high = at(curve.high), at(curve.low)
    return Curve('torsion', 'rad', 'N m', even, at(curve.y), low, high, curve.density)


def _answer(effect: type[Effect], x: np.ndarray, variable: str,
            values: dict[str, Value]) -> np.ndarray:
    """
    Return what a law says over a variable, forwards at 1 rad/s.

    All else is zero, and the temperature that from which a law counts.
    """
    seen = {'torsion': 'angle'}.get(variable, SEEN.get(variable, variable))
    if seen not in effect.motion._fields:
        seen = {'angle': 'load_angle'}.get(seen, seen)
    asked = _Values(values)
    rest: dict[str, Value] = dict.fromkeys(effect.motion._fields, 0.0)
    rest |= {name: 1.0 for name in ('direction', 'speed') if name in rest}
    if 'temperature' in rest:
        rest['temperature'] = values.get('reference', 0.0)
    if seen not in rest:
        return np.full(len(x), np.nan)
    memory = np.zeros(max(effect.memory, 1))
    answer = np.array([effect.law(asked, memory, effect.motion(**{**rest, seen: float(v)}), 0.0)
                       for v in x])
    return answer - x if effect.port == 'drive' else answer


class _Values:

    def __init__(self, values: dict[str, Value]) -> None:
        self.__dict__.update(values)


def _fitted(effect: type[Effect], curve: Curve) -> Formed | None:
    """Return a law of the catalogue fitted to a curve; None where it has no such variable."""
    values = {n: p.default for n, p in effect.parameters.items()}
    if any(p.row for p in effect.parameters.values()):
        return _waves(effect, curve, values)
    sought = [n for n in effect.parameters if n not in FIXED]
    size = curve.size() or 1e-300
    scale = {n: abs(_scale(effect, n, curve)) or 1.0 for n in sought}
    sure = np.sqrt(curve.density / curve.density.max())

    def error(q: np.ndarray) -> np.ndarray:
        now = {**values, **{n: v * scale[n] for n, v in zip(sought, q, strict=True)}}
        y = _answer(effect, curve.x, curve.variable, now)
        return sure * np.nan_to_num(y - curve.y, nan=1e3 * size) / size

    low, high = (np.array([effect.parameters[n].bounds[k] / scale[n] for n in sought])
                 for k in (0, 1))
    shapes = [n for n in sought if effect.parameters[n].off is None]
    tried = []
    for some in product(STARTS, repeat=len(shapes)):
        start = np.array([dict(zip(shapes, some, strict=True)).get(n, 1.0) for n in sought])
        start = np.minimum(np.maximum(start, low + 1e-6 * np.minimum(1.0, high - low)),
                           high - 1e-6 * (high - low))
        if not np.all((low < start) & (start < high)):
            return None
        tried.append(least_squares(error, start, bounds=(low, high), max_nfev=60))
    best = min(tried, key=lambda one: one.cost)
    told = best.jac.any(axis=0)  # what moves nothing of the curve keeps its default
    values |= {n: float(v * scale[n]) for n, v, moves in zip(sought, best.x, told, strict=True)
               if moves}
    left = _answer(effect, curve.x, curve.variable, values) - curve.y
    if not np.isfinite(left).all():
        return None
    free = tuple(n for n, moves in zip(sought, told, strict=True) if moves)
    return Formed(effect, values, free, _within(curve, left), _held(curve, left))


def _scale(effect: type[Effect], name: str, curve: Curve) -> float:
    """Return a size for a parameter: the curve's for an amplitude, its variable's for a shape."""
    parameter = effect.parameters[name]
    top, size = float(np.max(np.abs(curve.x))) or 1.0, float(np.max(np.abs(curve.y))) or 1.0
    if parameter.off is None:
        assert not isinstance(parameter.default, tuple)  # rows are waves
        return top if parameter.unit == curve.unit else parameter.default
    per = {'': size if parameter.unit == curve.y_unit else 1.0}
    if parameter.unit == curve.y_unit:
        return size
    power = 3 if parameter.unit.endswith('3') else 2 if parameter.unit.endswith('2') else 1
    return size / top**power if '/' in parameter.unit or not parameter.unit else per['']


def _within(curve: Curve, left: np.ndarray) -> bool:
    band = 0.5 * curve.size(curve.high - curve.low)
    return curve.size(left) <= max(FORM * curve.size(), band)


def _held(curve: Curve, left: np.ndarray) -> float:
    return float(max(0.0, 1.0 - (curve.size(left) / (curve.size() or 1e-300)) ** 2))


def _waves(effect: type[Effect], curve: Curve,
           values: dict[str, Value]) -> Formed | None:
    """Return the harmonics of a law fitted to a curve over a turn; None over a part of one."""
    if curve.variable != 'angle' or np.ptp(curve.x) < PASSED * TURN:
        return None
    orders = np.arange(1, MOST_MULTIPLES + 1)
    table = np.column_stack([f(k * curve.x) for k in orders for f in (np.cos, np.sin)])
    mean = np.average(curve.y, weights=curve.density)
    sure = np.sqrt(curve.density)[:, None]
    ridge = 1e-3 * np.sqrt((sure**2).sum()) * np.eye(table.shape[1])
    target = np.concatenate((sure[:, 0] * (curve.y - mean), np.zeros(len(ridge))))
    found = np.linalg.lstsq(np.vstack((sure * table, ridge)), target, rcond=None)[0]
    values |= {'order': 1.0, 'cosine': tuple(map(float, found[::2])),
               'sine': tuple(map(float, found[1::2]))}
    left = table @ found - curve.y
    return Formed(effect, values, ('cosine', 'sine'), _within(curve, left), _held(curve, left))


def of_orders(effect: type[Effect], knots: Sequence[float],
              amplitudes: np.ndarray) -> list[Formed]:
    """
    Return the effects of waves at some orders: one for a base order and its multiples.

    ``knots`` are the orders, each twice, for the amplitudes of cosine and sine.
    """
    waves = {}
    for at in range(0, len(knots) - 1, 2):
        if knots[at] > 0.0:
            waves[float(knots[at])] = float(amplitudes[at]), float(amplitudes[at + 1])
    groups: list[list[float]] = []
    for order in sorted(waves):
        for group in groups:
            base = order if not group else group[0]
            if order % base == 0.0 and order / base <= MOST_MULTIPLES:
                group.append(order)
                break
        else:
            groups.append([order])
    found = []
    for group in groups:
        base = group[0]
        rows = [waves.get(base * k, (0.0, 0.0)) for k in range(1, round(group[-1] / base) + 1)]
        cosine, sine = (tuple(r[i] for r in rows) for i in (0, 1))
        declared = effect.parameters
        values = {n: p.default for n, p in declared.items()} | {
            'order': base, 'cosine': cosine, 'sine': sine}
        values |= {n: (0.0,) * len(cosine) for n in declared if n.endswith('_change')}
        found.append(Formed(effect, values, ('cosine', 'sine'), True))
    return found


def _edge(effect: type[Effect], name: str) -> float:
    edge = effect.parameters[name].default
    assert not isinstance(edge, tuple)
    return edge


def _spline(effect: type[Effect], curve: Curve, turns: bool) -> Formed:
    """
    Return a flexible effect with the form of a curve; ``turns``: what it acts on turns.

    Over an angle it repeats where a whole turn was passed, and has as many coefficients as narrow
    places take. So many are held as the equations have them: they know the place better.
    """
    around = (turns and curve.variable == 'angle' and np.ptp(curve.x) > PASSED * TURN
              and _edge(effect, 'high') <= _edge(effect, 'low'))
    fewest = size = AROUND if around else COEFFICIENTS
    found, left = _coefficients(curve, size, around)
    while POINTS < len(curve.x) > 2 * size and not _within(curve, left):
        size = 2 * size
        found, left = _coefficients(curve, size, around)
    values = {n: p.default for n, p in effect.parameters.items()}
    values |= {'curve': tuple(map(float, found))}
    if not around:
        x = _sized(curve)
        low, high = float(x.min()), float(x.max())
        values |= {'low': low, 'high': high if high > low else low + 1e-9}
    return Formed(effect, values, ('curve',) if size == fewest else (), False)


def _sized(curve: Curve) -> np.ndarray:
    """Return the variable of a curve (points,), by its size where the effect is odd in it."""
    return np.abs(curve.x) if curve.variable in ('current', 'command', 'torsion') else curve.x


def _coefficients(curve: Curve, size: int, around: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients (size,) of a spline through a curve, and its error (points,)."""
    x = _sized(curve)
    y = curve.y if x is curve.x else np.sign(curve.x) * curve.y
    low, high = float(x.min()), float(x.max())
    rows = np.eye(size)
    table = np.array([[turning.py_func(row, v) if around else spline.py_func(row, v, low, high)
                       for row in rows] for v in x])
    bend = np.diff(rows, 2, axis=0)
    if around:
        bend = np.vstack((bend, rows[-2] - 2 * rows[-1] + rows[0],
                          rows[-1] - 2 * rows[0] + rows[1]))
    sure = np.sqrt(curve.density / curve.density.max())[:, None]
    found = np.linalg.lstsq(np.vstack((sure * table, 0.05 * bend)),
                            np.concatenate((sure[:, 0] * y, np.zeros(len(bend)))), rcond=None)[0]
    return found, table @ found - y
