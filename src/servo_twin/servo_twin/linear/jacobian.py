r"""
The linear form of a servo at rest in its operating point, from the servo's own compiled step.

The step F is differentiated by central differences, for three lengths h, and what is left of the
length is taken out by Richardson's extrapolation, so that the continuous laws remain:

.. math:: A = \lim_{h\to 0} \frac{1}{h}\left(\frac{\partial F_h}{\partial x} - I\right)

Numbers of the state that the step sets again each time (the current of a drive without inductance,
the load of a rigid mechanism, the torque) are not states of the linear form and are solved for.
Source of the extrapolation: Hairer, Norsett, Wanner: Solving ODE I, 1993, sec. II.9.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..physics import state
from .operating_point import Still

_READ = ('motor_position', 'load_position', 'torque', 'current')
_INPUTS = {'voltage': state.VOLTAGE, 'current': state.MEASURED_CURRENT,
           'external_torque': state.EXTERNAL}
_FASTEST = 4e-3  # the longest step, times the fastest rate of the servo


@dataclass(frozen=True)
class Matrices:
    """A linear form: ``states`` by name, and A, B, C, D in SI units."""

    states: tuple[str, ...]
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray


def matrices_of(still: Still, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> Matrices:
    """
    Return the continuous linear form from inputs to outputs.

    Only states that an output feels are kept. Where the servo does not care at which angle it
    stands, the angles are counted from the load's and named `wind_up`.
    """
    live = still.live()
    columns = [_INPUTS[name] for name in inputs]
    first = _differences(still, live, columns, 1e-7)
    set_anew = np.abs(np.diag(first[0]) - 1.0) > 0.5
    rates = np.linalg.eigvals(_continuous(first, set_anew, 1e-7)[0])
    rate = np.abs(rates).max(initial=1.0)
    longest = min(1e-3, _FASTEST / rate)
    read = _readings(still, live, columns, outputs)
    parts = []
    for h in (longest, longest / 2.0, longest / 4.0):
        found = _differences(still, live, columns, h)
        parts.append(_with_outputs(_continuous(found, set_anew, h), read, set_anew))
    a, b, c, d = (_extrapolated(*three) for three in zip(*parts, strict=True))

    # what is smaller than the rounding of its difference is nothing
    kept = [i for i, again in zip(live, set_anew, strict=True) if not again]
    changes = _changes(still, kept)
    least = 1024.0 * np.finfo(float).eps * (np.abs(still.x[kept]) + changes)[:, None] / longest
    a[np.abs(a) < least / changes] = 0.0
    b[np.abs(b) < least / _CHANGE_OF_INPUT] = 0.0
    names = _names(still, kept)
    a, b, c, names = _counted_from_load(a, b, c, names, still)
    used = felt(a, c)
    return Matrices(tuple(n for n, u in zip(names, used, strict=True) if u),
                    a[np.ix_(used, used)], b[used], c[:, used], d)


_CHANGE_OF_INPUT = 1e-3


def _extrapolated(whole: np.ndarray, half: np.ndarray, quarter: np.ndarray) -> np.ndarray:
    """Return what is left as the step vanishes; what vanishes with it becomes exactly zero."""
    left = (8.0 * quarter - 6.0 * half + whole) / 3.0
    return np.where(np.abs(left) < 1e-3 * np.abs(whole), 0.0, left)


def _changes(still: Still, live: list[int]) -> np.ndarray:
    """Return by how much each number of the state is moved to see what follows."""
    ratio = still.servo.values['mechanism.ratio']
    least = {state.MOTOR_ANGLE: 1e-6 * ratio, state.LOAD_ANGLE: 1e-6,
             state.MOTOR_SPEED: 1e-4 * ratio, state.LOAD_SPEED: 1e-4,
             state.CURRENT: 1e-3, state.TORQUE: 1e-3}
    angles = (state.MOTOR_ANGLE, state.LOAD_ANGLE)
    return np.array([least[i] if i in angles else max(least.get(i, 1e-6), 1e-4 * abs(still.x[i]))
                     for i in live])


def slopes(answer: Callable[[np.ndarray], np.ndarray], at: np.ndarray, which: Sequence[int],
           changes: Sequence[float]) -> np.ndarray:
    """
    Return the derivatives of an answer by some numbers of what is asked, by central differences.

    ``which`` of the numbers ``at`` are moved, each by its own of ``changes`` to either side;
    of shape (answers, len(which)). Good to the square of the changes.
    """
    columns = []
    for i, change in zip(which, changes, strict=True):
        sides = []
        for sign in (1.0, -1.0):
            moved = at.copy()
            moved[i] += sign * change
            sides.append(answer(moved))
        columns.append((sides[0] - sides[1]) / (2.0 * change))
    return np.column_stack(columns)


def _differences(still: Still, live: list[int], columns: list[int], h: float
                 ) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives of the step's result by the state and by the inputs."""
    by_state = slopes(lambda x: still.step(x, still.u, h)[live], still.x, live,
                      _changes(still, live))
    by_input = slopes(lambda u: still.step(still.x, u, h)[live], still.u, columns,
                      [_CHANGE_OF_INPUT] * len(columns))
    return by_state, by_input


def _continuous(found, again: np.ndarray, h: float) -> tuple[np.ndarray, ...]:
    """Return A, B, and how the numbers set again follow from states and inputs."""
    by_state, by_input = found
    goes = ~again
    settled = np.linalg.inv(np.eye(int(again.sum())) - by_state[np.ix_(again, again)])
    of_states = settled @ by_state[np.ix_(again, goes)]
    of_inputs = settled @ by_input[again]
    through = by_state[np.ix_(goes, again)]
    a = by_state[np.ix_(goes, goes)] - np.eye(int(goes.sum())) + through @ of_states
    b = by_input[goes] + through @ of_inputs
    return a / h, b / h, of_states, of_inputs


def _readings(still: Still, live: list[int], columns: list[int], outputs: tuple[str, ...]
              ) -> np.ndarray:
    """Return the derivatives of the outputs by the live numbers of the state."""
    read = slopes(lambda x: still.read(x, still.u), still.x, live, _changes(still, live))
    rows = np.zeros((len(outputs), len(live)))
    for row, name in zip(rows, outputs, strict=True):
        row[:] = (read[_READ.index(name)] if name in _READ
                  else np.equal(live, getattr(state, name.upper())))
    return rows


def _with_outputs(found, read: np.ndarray, again: np.ndarray) -> tuple[np.ndarray, ...]:
    a, b, of_states, of_inputs = found
    return a, b, read[:, ~again] + read[:, again] @ of_states, read[:, again] @ of_inputs


def _names(still: Still, kept: list[int]) -> list[str]:
    names = dict(enumerate(state.STATE))
    for (owner, slot), live in zip(still.memories(), still.remembers(), strict=True):
        if live:
            names.update({i: f'{owner}[{i - slot.start}]'
                          for i in range(slot.start, slot.stop)})
    return [names[i] for i in kept]


def _counted_from_load(a, b, c, names: list[str], still: Still):
    """Count angles from the load's, if turning all shafts together changes nothing."""
    if 'load_angle' not in names and 'motor_angle' not in names:
        return a, b, c, names
    ratio = still.servo.values['mechanism.ratio']
    pivot = names.index('load_angle' if 'load_angle' in names else 'motor_angle')
    turned = np.zeros(len(names))
    turned[pivot] = 1.0 if names[pivot] == 'load_angle' else ratio
    if 'motor_angle' in names:
        turned[names.index('motor_angle')] = ratio
    moved = a @ turned
    if np.abs(moved).max() > 1e-6 * np.abs(a * turned).max(initial=1e-300):
        return a, b, c, names
    a = a.copy()
    a[:, pivot] -= moved / turned[pivot]  # exactly nothing, now
    back = np.eye(len(names))  # x = back @ what is counted
    back[:, pivot] = turned
    if 'motor_angle' in names and pivot != names.index('motor_angle'):
        back[names.index('motor_angle'), names.index('motor_angle')] = ratio
        names = ['wind_up' if n == 'motor_angle' else n for n in names]
    there = np.linalg.inv(back)
    a, b, c = there @ a @ back, there @ b, c @ back
    a[:, pivot] = 0.0
    return a, b, c, names


def felt(a: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return which states an output feels, directly or through others."""
    reached = (np.abs(c) > 1e-12 * np.abs(c).max(initial=1e-300)).any(axis=0)
    for _ in range(len(a)):
        reached = reached | (a[reached] != 0.0).any(axis=0)
    return reached
