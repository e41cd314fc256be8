"""Where the laws of effects are steepest, within what the drive of a servo can do."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import product
import math
from types import SimpleNamespace

import numpy as np

from .plain_laws import Plain
from .servo import Placed, Servo

# where the curves of the catalogue are straight
_TORSION, _ANGLE, _SPEED, _ROLLING = 1e-12, 1e-6, 1e-9, 1e-6
_SHARE = 1e-9  # s/rad: of a value, for each rad/s of speed
_NEAR = 1e-4  # of a speed, a current or a torsion, over which the slope there is asked
_PARTS = 32  # of a period, in which the steepest place of a law that repeats is looked for
_PIECES = 16  # of an interval of a curve
_SPEEDS = np.logspace(-9.0, 6.0, 91)  # rad/s
_ROUNDING = 8.0 * float(np.finfo(float).eps)


def _periods(p: SimpleNamespace) -> list[float]:
    """Return the angles, rad, of one period of a law at which its slope is asked; ends above 0."""
    order, rows = getattr(p, 'order', 0.0), [v for v in vars(p).values() if isinstance(v, tuple)]
    if not order:
        return [0.0, 1.0]
    parts = _PARTS * max((len(row) for row in rows), default=1)
    return [2.0 * math.pi * k / (parts * order) for k in range(parts + 1)]


def _along_curve(p: SimpleNamespace) -> list[float]:
    """Return places all along a curve, of what it goes over; of what is no curve none."""
    curve = getattr(p, 'curve', ())
    if len(curve) < 4 and not (p.high <= p.low if curve else False):
        return []
    low, high, intervals = p.low, p.high, len(curve) - 3
    if high <= low:  # over a turn
        low, high, intervals = 0.0, 2.0 * math.pi, len(curve)
    pieces = _PIECES * intervals
    return [low + (high - low) * (k + 0.5) / pieces for k in range(pieces)]


def _to(most: float) -> list[float]:
    """Return places up to a largest value, to both sides of zero."""
    shares = np.append(np.logspace(-6.0, 0.0, 13) * (1.0 - _NEAR), 0.0)
    return [way * most * float(share) for share in shares for way in (1.0, -1.0)]


def _slope(law: Callable[..., float], field: str, change: float, **at: float) -> float:
    """Return the slope of a plain law by a field of its motion, what rounding makes left out."""
    ends = [law(**{**at, field: at.get(field, 0.0) + way}) for way in (change, -change)]
    rise = ends[0] - ends[1]
    if abs(rise) <= _ROUNDING * max(map(abs, ends)):
        return 0.0
    return rise / (2.0 * change)


def of_torque(servo: Servo, placed: Placed, current: float) -> tuple[float, float]:
    """
    Return by how much a torque on a shaft falls at most with its angle, and with its speed.

    ``current`` is the largest of the motor, A. What is remembered of the motion during a step is
    a spring as well: its share of the slope by speed goes with the length of the step.
    """
    law = Plain(servo, placed)
    places = _periods(law.p)
    small = min(_ANGLE, 1e-3 * places[-1])
    if placed.effect.memory:
        by_angle = min(_slope(law, 'angle', small, angle=place) for place in places)
        by_speed, more = _remembered(law, 'speed')
        return -(by_angle + more), -by_speed
    currents = (0.0, current, -current) if 'current' in placed.effect.variables() else (0.0,)
    by_angle = min(_slope(law, 'angle', small, angle=place, current=one)
                   for place, one in product(places + _along_curve(law.p), currents))
    return -by_angle, -_slope(law, 'speed', _SPEED)


def of_mesh(servo: Servo, placed: Placed, torsion: float) -> tuple[float, float]:
    """
    Return by how much the torque of the mesh rises at most with the torsion, and with its rate.

    ``torsion`` is the largest one, rad. See :func:`of_torque` for what is remembered.
    """
    law = Plain(servo, placed)
    places = _periods(law.p) if 'load_angle' in placed.effect.variables() else [0.0]
    if placed.effect.memory:
        by_rate, more = _remembered(law, 'rate')
        return more + max(_slope(law, 'angle', _TORSION, load_angle=place)
                          for place in places), by_rate
    torsions = _to(torsion) + [way * one for one in _along_curve(law.p) for way in (1.0, -1.0)]
    slopes = [_slope(law, 'angle', _TORSION, load_angle=place,
                     angle=way * 2.0 * _TORSION)  # not across a corner at zero
              for place, way in product(places, (1.0, -1.0))]
    slopes += [_slope(law, 'angle', _NEAR * abs(one), load_angle=place, angle=one)
               for place, one in product(places, torsions) if one]
    return max(slopes), _slope(law, 'rate', _SPEED)


def _remembered(law: Plain, rate: str) -> tuple[float, float]:
    """Return the slope by the rate, and what it is by what moves while the law remembers."""
    h = law.step
    whole, half = (_slope(lambda now=now, **at: law(now, **at), rate, _SPEED)
                   for now in (h, 0.5 * h))
    return 2.0 * half - whole, (whole - half) / (0.5 * h)


def by_current(servo: Servo, placed: Placed, current: float) -> float:
    """Return by how much a torque rises at most with the current up to a largest one, N m/A."""
    if placed.effect.memory or 'current' not in placed.effect.variables():
        return 0.0
    law = Plain(servo, placed)
    return max(_slope(law, 'current', _NEAR * abs(one) or _TORSION, current=one, angle=place)
               for one, place in product(_to(current) + _along_curve(law.p), _periods(law.p)))


def of_error(servo: Servo, placed: Placed) -> tuple[float, float, float]:
    """
    Return how steep an error of the teeth is at most: rad/rad by the load, and by the motor.

    Third is how fast the slope by the motor changes, 1/rad.
    """
    law, effect = Plain(servo, placed), placed.effect
    if effect.memory:
        return 0.0, 0.0, 0.0
    places = _periods(law.p)
    small = min(_ANGLE, 1e-3 * places[-1])
    by_load = max(abs(_slope(law, 'load_angle', small, load_angle=place, direction=way,
                             travel=1e9))
                  for place, way in product(places + _along_curve(law.p), (1.0, -1.0)))
    if not hasattr(effect, 'motor_slope'):
        return by_load, 0.0, 0.0

    def motor_slope(**at: float) -> float:
        return float(law.side('motor_slope')(law.p, law.motion(**at)))

    return (by_load, max(abs(motor_slope(motor_angle=place)) for place in places),
            max(abs(_slope(motor_slope, 'motor_angle', small, motor_angle=place))
                for place in places))


def of_friction(servo: Servo, placed: Placed, push: Callable[[float], float] | None) -> float:
    """
    Return by how much friction rises at most with the speed of its shaft, N m s/rad.

    Asked are the speeds at which ``push(speed)``, the most torque at the shaft (N m), still
    overcomes it. None where nothing limits that torque: of drag that goes on rising ever steeper
    only its slope near rest counts then.
    """
    if 'speed' not in placed.effect.variables():
        return 0.0
    law = Plain(servo, placed)

    def at(speed: float) -> float:
        return law(speed=speed, direction=1.0)

    def slopes(speeds: Iterable[float]) -> list[float]:
        return [_slope(at, 'speed', (0.5 if one < _ROLLING else _NEAR) * one, speed=one)
                for one in speeds]

    near = _slope(at, 'speed', 0.5 * _ROLLING, speed=1.5 * _ROLLING)
    places = [one for one in (*_SPEEDS, *_along_curve(law.p)) if one > 0.0]
    if push is None:
        found = slopes(places)
        far, farther = slopes((0.5 * _SPEEDS[-1], _SPEEDS[-1]))
        return near if farther > far * (1.0 + 1e-6) > 0.0 else max(near, *found)
    within = [one for one in places if push(one) >= at(one)]
    fastest = max(within, default=0.0)
    beyond = min((one for one in places if one > fastest), default=fastest)
    for _ in range(30):  # to the speed at which the two are equal
        middle = 0.5 * (fastest + beyond)
        fastest, beyond = ((middle, beyond) if push(middle) >= at(middle) else
                           (fastest, middle))
    return max(near, 0.0, *slopes([*within, fastest] if fastest else within))


def of_signal(servo: Servo, placed: Placed) -> float:
    """
    Return by how much a signal falls with the motor speed that it makes, at most, never negative.

    In V s/rad, of a current in A s/rad. Signals of each size are asked: a limit cuts the large
    ones alone. The speed goes with the size, so that the difference is none of rounding.
    """
    law, found = Plain(servo, placed), 0.0
    for value in (way * size for size in np.logspace(-9.0, 9.0, 37) for way in (1.0, -1.0)):
        change = _SHARE * abs(value)
        sides = [law(value=value, speed=speed) for speed in (change, -change)]
        found = max(found, (sides[1] - sides[0]) / (2.0 * change))
    return found
