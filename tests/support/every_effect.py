"""A servo that has every effect of the catalogue at every place where it may act."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterable, Mapping
import fcntl
from functools import cache

import numpy as np

from servo_twin.physics.catalogue import find, names
from servo_twin.physics.controllers import VelocityPi
from servo_twin.physics.drives import CurrentDrive
from servo_twin.physics.effect import Effect
from servo_twin.physics.kernel import cache_folder
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.servo import Placed, Servo, Value
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.physics.state import INPUTS

PLACED = tuple(Placed(f'{name}_at_{site}', find(name), site)
               for name in names() for site in find(name).sites)
LEARNED = {
    f'effects.{placed.name}.{name}': (parameter.default * 5)
    for placed in PLACED for name, parameter in placed.effect.parameters.items()
    if parameter.row and placed.effect.name.startswith('network')
}


@cache
def _compile() -> None:
    """Compile the kernel in one test process while others wait for what it leaves on disk."""
    plain = Servo('every_effect', CurrentDrive, TwoInertia, VelocityPi, (), PLACED, LEARNED)
    with open(cache_folder() / 'every_effect.lock', 'w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        simulate(plain, inputs(1), 1e-3, initial_state(plain))


def servo(values: Mapping[str, Value] | None = None, step: float = 1e-4) -> Servo:
    """Return the servo with some values of its own; of one structure, so compiled once."""
    _compile()
    return Servo('every_effect', CurrentDrive, TwoInertia, VelocityPi, (), PLACED,
                 {**LEARNED, **(values or {})}, step=step)


def only(*wanted: str) -> np.ndarray:
    """Return the switches that leave on the effects of these names alone."""
    unknown = set(wanted) - {placed.name for placed in PLACED}
    assert not unknown, f'{unknown} is not placed'
    return np.array([placed.name in wanted for placed in PLACED])


def off(names_of_amplitudes: Iterable[Placed] = PLACED) -> dict[str, Value]:
    """Return the values at which the amplitudes of these effects vanish."""
    values = {}
    for placed in names_of_amplitudes:
        for name in placed.effect.amplitudes():
            parameter = placed.effect.parameters[name]
            path = f'effects.{placed.name}.{name}'
            length = len(LEARNED.get(path, parameter.default)) if parameter.row else 1
            values[path] = (parameter.off,) * length if parameter.row else parameter.off
    return values


def parameters(effect: type[Effect], **changes):
    """Return an effect's parameters as its law gets them: rows as arrays, the rest floats."""
    values = {}
    for name, parameter in effect.parameters.items():
        value = changes.get(name, parameter.default)
        values[name] = np.asarray(value, dtype=float) if parameter.row else float(value)
    return namedtuple(effect.name, values)(**values)


def inputs(samples: int, **columns) -> np.ndarray:
    """Return inputs of which all but the given columns are missing."""
    filled = {name: np.full(samples, np.nan) for name in INPUTS}
    for name, column in columns.items():
        filled[name] = np.broadcast_to(column, samples).astype(float)
    return inputs_of(filled)
