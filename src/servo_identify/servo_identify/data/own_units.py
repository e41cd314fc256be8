r"""
A command or a current in a unit that has no name: a duty, the counts of a PWM or of a converter.

The equation of the drive tells what one of them is, with the values of the servo file:

.. math:: f_u\,K_v u = f_i\,R\,i + k_e\,\omega

Each of the factors is found alone, by least squares, and both together where the motor turns.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import log

import numpy as np

from servo_twin.physics.servo import Servo

from .drive_equation import drive_equation
from .mistakes import MISTAKE, Mistake
from .signals import Signals

FURTHER = 10.0  # than this a servo file is not off by: the factor is one of a unit
RARE = MISTAKE + log(40.0)  # nats: of scales over six decades, each told within a third
UNITS = {'voltage': 'V', 'current': 'A'}


def own_units(seen: Sequence[Signals], servo: Servo) -> Iterator[Mistake]:
    """Yield which channels of recordings of one machine may be in units of their own."""
    told = [own.parts() for at in seen if (own := drive_equation(at, servo)) is not None]
    if not told or len(told) < len(seen):
        return
    command, drop, back = np.concatenate([part - part.mean(axis=1)[:, None] for part in told], 1)
    alone = {'voltage': _factors(back + drop, command), 'current': _factors(command - back, drop)}
    for name, factors in alone.items():
        yield from _of_its_own([name], factors)
    yield from _of_its_own(['voltage', 'current'], _factors(back, command, -drop))


def _factors(seen: np.ndarray, *columns: np.ndarray) -> np.ndarray:
    """Return the factors with which the columns make most of what is seen: (columns,)."""
    return np.linalg.lstsq(np.stack(columns, 1), seen, rcond=1e-9)[0]


def _of_its_own(names: list[str], factors: np.ndarray) -> Iterator[Mistake]:
    if np.all(factors > 0.0) and np.all(abs(np.log(factors)) > log(FURTHER)):
        told = ', '.join(f'{name} [{factor:.3g} {UNITS[name]}]'
                         for name, factor in zip(names, factors, strict=True))
        what = 'is in a unit of its own' if len(names) == 1 else 'are in units of their own'
        yield Mistake(f'{" and ".join(names)} {what}: a duty or counts',
                      f'give what 1 of them is in the header or the mapping, about {told}',
                      dict(zip(names, factors.tolist(), strict=True)), cost=RARE * len(names))
