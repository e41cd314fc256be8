"""
What a rig is told to do: set-points of one excitation family, made for one machine.

The names are those that recordings carry. A family says which quantity it commands, and holds what
it needs to show (GAP_METHOD, table of signatures): speeds both ways, reversals, load steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

VOLTAGE, VELOCITY, POSITION = 1, 3, 4
"""Modes of `servo_twin_msgs/Command`."""


@dataclass(frozen=True)
class Reach:
    """How far a machine may be driven: load speed, load angle, external torque, command."""

    speed: float = 0.6  # rad/s
    angle: float = 1.5  # rad, to either side
    torque: float = 300.0  # N m, of the load simulator
    voltage: float = 1.0  # V


@dataclass(frozen=True)
class Excitation:
    """
    A sequence of set-points, one every ``period`` seconds.

    ``reference`` in V, rad/s or rad by ``mode``, ``external_torque`` in N m (NaN: leave as it is);
    both of shape (set-points,). It begins and ends at rest.
    """

    family: str
    mode: int
    period: float
    reference: np.ndarray
    external_torque: np.ndarray


def excite(family: str, duration: float, period: float, reach: Reach) -> Excitation:
    """Return the excitation of a family; raises ValueError with the families there are."""
    if family not in FAMILIES:
        raise ValueError(f'there is no excitation family {family!r}; there are {list(FAMILIES)}')
    if not duration > 10.0 * period:
        raise ValueError(f'duration = {duration:g} s, it must be above {10.0 * period:g} s')
    time = np.arange(round(duration / period)) * period
    mode, reference, torque = FAMILIES[family](time, duration, reach)
    ramp = np.minimum(1.0, np.minimum(time, duration - period - time) / min(0.5, duration / 8.0))
    return Excitation(family, mode, period, reference * np.clip(ramp, 0.0, 1.0),
                      torque * np.clip(ramp, 0.0, 1.0))


def _sine(time: np.ndarray, duration: float, reach: Reach) -> tuple[int, np.ndarray, np.ndarray]:
    """Two sines of speed whose periods share no multiple: speeds, reversals and turns in one."""
    slow = 2.0 * np.pi * 0.25
    speed = 0.65 * np.sin(slow * time) + 0.35 * np.sin(3.1 * slow * time)
    return VELOCITY, reach.speed * speed, np.zeros(len(time))


def _speed_ladder(time, duration, reach):
    """Six speeds, each both ways."""
    steps = np.array([0.05, 0.1, 0.2, 0.4, 0.7, 1.0])
    phase = time / duration * len(steps) * 2.0
    step = np.minimum(phase.astype(int), 2 * len(steps) - 1)
    sign = np.where(step % 2 == 0, 1.0, -1.0)
    return VELOCITY, reach.speed * steps[step // 2] * sign, np.zeros(len(time))


def _slow_reversals(time, duration, reach):
    """Triangles of position, slow: friction at rest, presliding, lost motion."""
    turns = time / min(4.0, duration / 2.0) % 1.0
    triangle = np.where(turns < 0.5, 1.0, -1.0)
    return VELOCITY, 0.08 * reach.speed * triangle, np.zeros(len(time))


def _load_steps(time, duration, reach):
    """A constant slow speed each way while the load simulator steps through its torques."""
    levels = np.array([0.0, 0.5, 1.0, 0.5, 0.0, -0.5, -1.0, -0.5])
    level = np.minimum((time / duration * 2.0 * len(levels)).astype(int), 2 * len(levels) - 1)
    sign = np.where(level < len(levels), 1.0, -1.0)
    return VELOCITY, 0.2 * reach.speed * sign, reach.torque * levels[level % len(levels)]


def _chirp(time, duration, reach):
    """A speed that sweeps from 0.1 to 10 Hz."""
    rate = np.log(100.0) / duration
    phase = 2.0 * np.pi * 0.1 * (np.exp(rate * time) - 1.0) / rate
    return VELOCITY, 0.4 * reach.speed * np.sin(phase), np.zeros(len(time))


def _multisine(time, duration, reach):
    """Twenty sines of speed with Schroeder phases, 0.5 to 20 Hz."""
    orders = np.unique(np.geomspace(0.5, 20.0, 20).round(2))
    phases = -np.pi * np.arange(len(orders)) ** 2 / len(orders)
    total = np.cos(2.0 * np.pi * np.outer(time, orders) + phases).sum(axis=1)
    return VELOCITY, 0.5 * reach.speed * total / np.max(np.abs(total)), np.zeros(len(time))


def _hold(time, duration, reach):
    """At rest at one angle while the load simulator pulls both ways."""
    torque = reach.torque * np.sin(2.0 * np.pi * time / duration * 3.0)
    return POSITION, np.zeros(len(time)), torque


def _coast_down(time, duration, reach):
    """Command, then none: the shaft runs out by its own friction, each way."""
    turns = time / duration * 4.0 % 1.0
    sign = np.where((time / duration * 4.0).astype(int) % 2 == 0, 1.0, -1.0)
    return VOLTAGE, reach.voltage * sign * (turns < 0.4), np.zeros(len(time))


_Family = Callable[[np.ndarray, float, Reach], tuple[int, np.ndarray, np.ndarray]]

FAMILIES: dict[str, _Family] = {
    'sine': _sine, 'speed_ladder': _speed_ladder, 'slow_reversals': _slow_reversals,
    'load_steps': _load_steps, 'chirp': _chirp, 'multisine': _multisine, 'hold': _hold,
    'coast_down': _coast_down,
}
"""Families by name."""
