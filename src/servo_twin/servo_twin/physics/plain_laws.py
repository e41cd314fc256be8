"""The laws of effects and drives as plain Python: to read a file should compile nothing."""

from __future__ import annotations

from collections.abc import Callable
import math
from types import FunctionType, SimpleNamespace
from typing import Any

from numba.core.dispatcher import Dispatcher
import numpy as np

from . import spline
from .dahl_state import built_up
from .effect import Effect
from .elementary_functions import limited
from .harmonics import wave, wave_slope
from .maxwell_slip import slipped
from .servo import Placed, Servo
from .thinning import STRAIGHT, thinned

_ROOM = 20.0  # degC


def _cos_sin(angle: float) -> tuple[float, float]:
    return math.cos(angle), math.sin(angle)


def _plain(compiled: Dispatcher, **names: object) -> FunctionType:
    return FunctionType(compiled.py_func.__code__, names)


_WAVES: dict[str, object] = {'cos_sin': _cos_sin, 'len': len, 'range': range}
_CURVE: dict[str, object] = {'len': len, 'min': min, 'max': max, 'int': int, 'float': float,
                             'floor': math.floor, 'pi': math.pi, '_cubic': spline._cubic.py_func}
_SPLINE = _plain(spline.spline, **_CURVE)
_PLAIN: dict[str, Callable[..., object]] = {
    'exp': math.exp, 'sqrt': math.sqrt, 'cos_sin': _cos_sin, 'slipped': slipped.py_func,
    'limited': limited.py_func, 'spline': _SPLINE,
    'over_angle': _plain(spline.over_angle, spline=_SPLINE,
                         turning=_plain(spline.turning, **_CURVE)),
    'built_up': _plain(built_up, exp=math.exp, abs=abs),
    'thinned': _plain(thinned, exp=math.exp, STRAIGHT=STRAIGHT),
    'wave': _plain(wave, **_WAVES), 'wave_slope': _plain(wave_slope, **_WAVES)}


def uncompiled(law: Callable[..., float]) -> Callable[..., float] | None:
    """Return a law with the functions of `math`; None for one of a network, which is compiled."""
    assert isinstance(law, FunctionType)
    used = {name: law.__globals__.get(name) for name in law.__code__.co_names}
    own = {name: _PLAIN[name] for name in used if name in _PLAIN}
    if any(isinstance(thing, Dispatcher) for name, thing in used.items() if name not in own):
        return None
    return FunctionType(law.__code__, {**law.__globals__, **own})


def acts_at(placed: Placed, port: str, site: str) -> bool:
    """Whether an effect acts there by a law that can be asked without compiling it."""
    return (placed.effect.port == port and placed.site == site
            and uncompiled(placed.effect.law) is not None)


def values_of(servo: Servo, placed: Placed) -> SimpleNamespace:
    """Return the values of an effect by the names of its parameters."""
    return SimpleNamespace(**{name: servo.values[f'effects.{placed.name}.{name}']
                              for name in placed.effect.parameters})


class Plain:
    """An effect of a servo whose plain law is asked at rest, but for some fields of the motion."""

    def __init__(self, servo: Servo, placed: Placed) -> None:
        law = uncompiled(placed.effect.law)
        assert law is not None
        self.effect: type[Effect] = placed.effect
        self.law: Callable[..., float] = law
        self.p, self.step = values_of(servo, placed), servo.step
        self._still: dict[str, float] = dict.fromkeys(placed.effect.motion._fields, 0.0)
        if 'temperature' in self._still:
            self._still['temperature'] = _ROOM

    def side(self, name: str) -> Callable[..., float]:
        """Return another plain law that the effect has beside its own."""
        law = uncompiled(getattr(self.effect, name))
        assert law is not None
        return law

    def motion(self, **fields: float) -> Any:
        """Return the motion of what stands in a warm room, but for the given fields."""
        return self.effect.motion(**{**self._still, **fields})

    def __call__(self, h: float | None = None, **fields: float) -> float:
        """Return what the law gives with a memory of zeros, ``h`` (s) after it was last asked."""
        memory = np.zeros(self.effect.memory) if self.effect.memory else ()
        motion = self.effect.motion(**{**self._still, **fields})
        return float(self.law(self.p, memory, motion, self.step if h is None else h))
