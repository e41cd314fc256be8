"""How steep the laws of effects are near rest: slopes by angle, by speed and by memory."""

from __future__ import annotations

from collections.abc import Callable
import math
from types import FunctionType, SimpleNamespace

from numba.core.dispatcher import Dispatcher
import numpy as np

from .dahl_state import built_up
from .effect import Effect
from .harmonics import wave
from .maxwell_slip import slipped
from .servo import Placed, Servo
from .thinning import STRAIGHT, thinned

# where the curves of the catalogue are straight
_TORSION, _ANGLE, _SPEED, _ROLLING = 1e-12, 1e-6, 1e-9, 1e-6
_FAST = 1e5  # rad/s: beyond what fades with the speed
_SHARE = 1e-9  # s/rad: of a value, for each rad/s of speed
_PARTS = 32  # of a period, in which the steepest place of a law that repeats is looked for
_ROOM = 20.0  # degC


def _cos_sin(angle: float) -> tuple[float, float]:
    return math.cos(angle), math.sin(angle)


_PLAIN: dict[str, Callable[..., object]] = {
    'exp': math.exp, 'sqrt': math.sqrt, 'cos_sin': _cos_sin, 'slipped': slipped.py_func,
    'built_up': FunctionType(built_up.py_func.__code__, {'exp': math.exp, 'abs': abs}),
    'thinned': FunctionType(thinned.py_func.__code__, {'exp': math.exp, 'STRAIGHT': STRAIGHT}),
    'wave': FunctionType(wave.py_func.__code__, {'cos_sin': _cos_sin, 'len': len, 'range': range})}


def acts_at(placed: Placed, port: str, site: str) -> bool:
    """Whether an effect acts there by a law that can be asked without compiling it."""
    return (placed.effect.port == port and placed.site == site
            and _uncompiled(placed.effect) is not None)


def _uncompiled(effect: type[Effect]) -> Callable[..., float] | None:
    """
    Return an effect's law with the functions of `math`: to read a file should compile nothing.

    None for a law that calls something else that is compiled: curves and networks.
    """
    law = effect.law
    assert isinstance(law, FunctionType)
    used = {name: law.__globals__.get(name) for name in law.__code__.co_names}
    own = {name: _PLAIN[name] for name in used if name in _PLAIN}
    if any(isinstance(thing, Dispatcher) for name, thing in used.items() if name not in own):
        return None
    return FunctionType(law.__code__, {**law.__globals__, **own})


def values_of(servo: Servo, placed: Placed) -> SimpleNamespace:
    """Return the values of an effect by the names of its parameters."""
    return SimpleNamespace(**{name: servo.values[f'effects.{placed.name}.{name}']
                              for name in placed.effect.parameters})


def _places(p: SimpleNamespace) -> list[float]:
    """Return the angles, rad, of one period of a law at which its slope is asked; ends above 0."""
    order, rows = getattr(p, 'order', 0.0), [v for v in vars(p).values() if isinstance(v, tuple)]
    if not order:
        return [0.0, 1.0]
    parts = _PARTS * max((len(row) for row in rows), default=1)
    return [2.0 * math.pi * k / (parts * order) for k in range(parts + 1)]


def _rest(effect: type[Effect], **fields: float) -> object:
    """Return the motion of a shaft that stands in a warm room, but for the given fields."""
    still = dict.fromkeys(effect.motion._fields, 0.0)
    return effect.motion(**{name: fields.get(name, _ROOM if name == 'temperature' else value)
                            for name, value in still.items()})


def slopes(servo: Servo, placed: Placed, angle: str, rate: str) -> tuple[float, float]:
    """
    Return the slopes at rest of a torque by an angle and by its rate.

    Of a law that repeats over the angle, they are those where it falls most (in the mesh rises).
    What is remembered of the motion during a step is a spring as well: its share of the slope by
    the rate goes with the length of the step.
    """
    effect, p, law = placed.effect, values_of(servo, placed), _uncompiled(placed.effect)
    assert law is not None

    def slope(field: str, change: float, h: float, place: float = 0.0) -> float:
        sides = []
        for way in (change, -change):
            at = {turning: place}
            at[field] = at.get(field, 0.0) + way
            sides.append(law(p, np.zeros(effect.memory), _rest(effect, **at), h))
        return float(sides[0] - sides[1]) / (2.0 * change)

    h, turning = servo.step, 'load_angle' if effect.port == 'mesh' else angle
    places = _places(p)
    small = _TORSION if effect.port == 'mesh' else min(_ANGLE, 1e-3 * places[-1])
    steepest = max if effect.port == 'mesh' else min
    by_angle = steepest(slope(angle, small, h, place) for place in places)
    by_rate, sooner = slope(rate, _SPEED, h), slope(rate, _SPEED, 0.5 * h)
    if effect.memory and effect.port in ('torque', 'mesh'):
        return by_angle + (by_rate - sooner) / (0.5 * h), 2.0 * sooner - by_rate
    return by_angle, by_rate


def rise(servo: Servo, placed: Placed) -> float:
    """
    Return the slope of friction by the speed of its shaft.

    It is the larger one of that near rest and that of a fast shaft, where that one is straight.
    """
    effect, p, law = placed.effect, values_of(servo, placed), _uncompiled(placed.effect)
    assert law is not None

    def slope(speed: float) -> float:
        slow, fast = (float(law(p, np.zeros(effect.memory), _rest(
            effect, speed=one, direction=1.0), servo.step)) for one in (speed, 2.0 * speed))
        return (fast - slow) / speed

    far, farther = slope(_FAST), slope(2.0 * _FAST)
    straight = abs(farther - far) <= 1e-6 * abs(far)  # drag that goes on rising is none
    return max(slope(_ROLLING), far if straight else 0.0)


def fall(servo: Servo, placed: Placed) -> float:
    """
    Return by how much a signal falls with the motor speed that it makes, at most, never negative.

    In V s/rad, of a current in A s/rad. Signals of each size are asked: a limit cuts the large
    ones alone. The speed goes with the size, so that the difference is none of rounding.
    """
    effect, p, law = placed.effect, values_of(servo, placed), _uncompiled(placed.effect)
    assert law is not None
    found = 0.0
    for value in (way * size for size in np.logspace(-9.0, 9.0, 37) for way in (1.0, -1.0)):
        change = _SHARE * abs(value)
        sides = [float(law(p, np.zeros(effect.memory), _rest(effect, value=value, speed=speed),
                           servo.step)) for speed in (change, -change)]
        found = max(found, (sides[1] - sides[0]) / (2.0 * change))
    return found
