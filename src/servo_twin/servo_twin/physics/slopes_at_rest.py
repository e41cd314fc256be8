"""How steep the laws of effects are near rest: slopes by angle, by speed and by memory."""

from __future__ import annotations

from collections.abc import Callable
import math
from types import FunctionType, SimpleNamespace

from numba.core.dispatcher import Dispatcher
import numpy as np

from .dahl_state import built_up
from .effect import Effect
from .maxwell_slip import slipped
from .servo import Placed, Servo

# where the curves of the catalogue are straight
_TORSION, _ANGLE, _SPEED, _ROLLING = 1e-12, 1e-6, 1e-9, 1e-6
_SHARE = 1e-9  # s/rad: of a value, for each rad/s of speed
_PLAIN: dict[str, Callable[..., object]] = {
    'exp': math.exp, 'sqrt': math.sqrt,
    'cos_sin': lambda angle: (math.cos(angle), math.sin(angle)), 'slipped': slipped.py_func,
    'built_up': FunctionType(built_up.py_func.__code__, {'exp': math.exp, 'abs': abs})}


def acts_at(placed: Placed, port: str, site: str) -> bool:
    """Whether an effect acts there by a law that can be asked without compiling it."""
    return (placed.effect.port == port and placed.site == site
            and _uncompiled(placed.effect) is not None)


def _uncompiled(effect: type[Effect]) -> Callable[..., float] | None:
    """
    Return an effect's law with the functions of `math`: to read a file should compile nothing.

    None for a law that calls something else that is compiled: series of harmonics and curves.
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


def slopes(servo: Servo, placed: Placed, angle: str, rate: str) -> tuple[float, float]:
    """
    Return the slopes at rest of a torque by an angle and by its rate.

    What is remembered of the motion during a step is a spring as well: its share of the slope by
    the rate goes with the length of the step.
    """
    effect, p, law = placed.effect, values_of(servo, placed), _uncompiled(placed.effect)
    assert law is not None

    def slope(field: str, change: float, h: float) -> float:
        sides = []
        for way in (change, -change):
            motion = effect.motion(**{**dict.fromkeys(effect.motion._fields, 0.0), field: way})
            sides.append(law(p, np.zeros(effect.memory), motion, h))
        return float(sides[0] - sides[1]) / (2.0 * change)

    h = servo.step
    by_angle = slope(angle, _TORSION if effect.port == 'mesh' else _ANGLE, h)
    by_rate, sooner = slope(rate, _SPEED, h), slope(rate, _SPEED, 0.5 * h)
    if effect.memory and effect.port in ('torque', 'mesh'):
        return by_angle + (by_rate - sooner) / (0.5 * h), 2.0 * sooner - by_rate
    return by_angle, by_rate


def rise(servo: Servo, placed: Placed) -> float:
    """Return the slope of friction by the speed of its shaft, near rest."""
    effect, p, law = placed.effect, values_of(servo, placed), _uncompiled(placed.effect)
    assert law is not None
    budgets = [float(law(p, np.zeros(effect.memory), effect.motion(
        **{**dict.fromkeys(effect.motion._fields, 0.0), 'speed': speed, 'direction': 1.0}),
        servo.step)) for speed in (_ROLLING, 2.0 * _ROLLING)]
    return (budgets[1] - budgets[0]) / _ROLLING


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
        sides = [float(law(p, np.zeros(effect.memory), effect.motion(
            **{**dict.fromkeys(effect.motion._fields, 0.0), 'value': value, 'speed': speed}),
            servo.step)) for speed in (change, -change)]
        found = max(found, (sides[1] - sides[0]) / (2.0 * change))
    return found
