"""
The procedures: what a rig is driven through to learn one thing about it.

Those of paper 000: `friction` (section 3.1), `backlash` (3.2), `transmission_error` (3.3),
`open_loop_sine` and `open_loop_square` (4.1, table 4), `velocity_loop` (4.2, figure 12),
`reversal` (figure 13), `position_ramp` (figure 14). Those of paper 003 (section 3.2):
`multilevel_steps`, `sinusoids`. The others are what a diagnosis asks for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi, radians

import numpy as np

from . import setpoint_profiles as profiles

MODES = ('voltage', 'current', 'velocity', 'position')
TURN = 2.0 * pi


@dataclass(frozen=True)
class Run:
    """
    One recording: set-points from rest to rest, one every ``period`` s.

    ``reference`` (n,) is in V, A, rad/s or rad by ``mode``, the last two at the load shaft; a
    position counts from where the run begins. ``external_torque`` (n,), N m, resists the load.
    """

    name: str
    family: str
    mode: str
    period: float
    reference: np.ndarray
    external_torque: np.ndarray
    replicate: int = 1

    @property
    def duration(self) -> float:
        """Seconds from the first set-point to the end of the last one."""
        return len(self.reference) * self.period


@dataclass(frozen=True)
class Choices:
    """
    What is left to the experimenter; None and empty leave it to the procedure.

    ``speeds`` rad/s at the load, ``torques`` N m at the load, ``amplitudes`` V, ``frequencies``
    Hz, ``angle`` rad of the load, ``duration`` s of what repeats itself.
    """

    period: float = 1e-3
    replicates: int = 1
    speeds: tuple[float, ...] = ()
    torques: tuple[float, ...] = ()
    amplitudes: tuple[float, ...] = ()
    frequencies: tuple[float, ...] = ()
    angle: float | None = None
    duration: float | None = None


@dataclass(frozen=True)
class Procedure:
    """One procedure: its law gives (name, mode, reference, external torque) of each recording."""

    name: str
    summary: str
    law: Callable[[Choices], list[tuple[str, str, np.ndarray, np.ndarray | float]]]

    def runs(self, choices: Choices) -> list[Run]:
        """
        Return the recordings to make, in their order.

        Raises ValueError for a choice that is not positive or makes nothing finite.
        """
        _check(choices)
        found = []
        for name, mode, reference, torque in self.law(choices):
            external = (profiles.loaded(torque, len(reference), choices.period)
                        if np.ndim(torque) == 0 else torque)
            if not (np.isfinite(reference).all() and np.isfinite(external).all()):
                raise ValueError(f'{name}: these choices give no finite set-points: {choices}')
            for replicate in range(1, choices.replicates + 1):
                suffix = f'_{replicate}' if choices.replicates > 1 else ''
                found.append(Run(name + suffix, self.name, mode, choices.period, reference,
                                 external, replicate))
        return found


def _check(choices: Choices) -> None:
    named = {'period': (choices.period,), 'replicates': (choices.replicates,),
             'speeds': choices.speeds, 'amplitudes': choices.amplitudes,
             'frequencies': choices.frequencies}
    named |= {name: (value,) for name, value in (
        ('angle', choices.angle), ('duration', choices.duration)) if value is not None}
    for name, values in named.items():
        for value in values:
            if not 0.0 < value < np.inf:
                raise ValueError(f'{name} = {value:g}; it must be positive and finite')


def _time(seconds: float, c: Choices) -> np.ndarray:
    return np.arange(round((c.duration or seconds) / c.period)) * c.period


def _friction(c: Choices) -> list:
    speeds = c.speeds or (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)
    return [(f'friction_{v:g}', 'velocity', profiles.there_and_back(v, c.angle or TURN, c.period),
             0.0) for v in speeds]


def _backlash(c: Choices) -> list:
    speed = (c.speeds or (radians(10.0),))[0]
    return [(f'backlash_{t:g}', 'velocity',
             profiles.there_and_back(speed, c.angle or TURN, c.period), t)
            for t in c.torques or (-60.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0)]


def _transmission_error(c: Choices) -> list:
    return [(f'transmission_error_{v:g}', 'velocity',
             profiles.there_and_back(v, c.angle or TURN, c.period), 0.0)
            for v in c.speeds or (0.05, 0.1, 0.2, 0.4)]


def _open_loop(shape: str) -> Callable[[Choices], list]:
    def law(c: Choices) -> list:
        made = []
        time = _time(10.0, c)
        for f in c.frequencies or (1.0, 0.5):
            for u in c.amplitudes or (1.5, 1.6, 1.7, 1.8):
                wave = np.sin(2.0 * pi * f * time)
                if shape == 'square':
                    wave = np.where((time * f + 1e-9) % 1.0 < 0.5, 1.0, -1.0)
                made.append((f'{shape}_{u:g}V_{f:g}Hz', 'voltage',
                             profiles.framed(u * wave, c.period), 0.0))
        return made
    return law


def _velocity_loop(c: Choices) -> list:
    f = (c.frequencies or (1.0,))[0]
    speed = (c.speeds or (radians(10.0),))[0]
    wave = speed * np.sin(2.0 * pi * f * _time(10.0, c))
    return [('velocity_loop', 'velocity', profiles.framed(wave, c.period), 0.0)]


def _reversal(c: Choices) -> list:
    speed = (c.speeds or (radians(3.0),))[0]
    return [('reversal', 'velocity',
             profiles.there_and_back(speed, c.angle or TURN, c.period), 0.0)]


def _position_ramp(c: Choices) -> list:
    slope, angle = (c.speeds or (0.05,))[0], c.angle or 0.2
    way = np.cumsum(profiles.there_and_back(slope, angle, c.period)) * c.period
    return [(f'position_ramp_{t:g}', 'position', way, t) for t in c.torques or (0.0, 30.0, 60.0)]


def _speed_ladder(c: Choices) -> list:
    speeds = c.speeds or tuple(np.geomspace(0.01, 1.0, 8))
    rung = round((c.duration or 24.0) / c.period / (2 * len(speeds)))
    steps = np.concatenate([np.full(rung, way * v) for v in speeds for way in (1.0, -1.0)])
    return [('speed_ladder', 'velocity',
             profiles.eased(profiles.framed(steps, c.period), c.period), 0.0)]


def _load_steps(c: Choices) -> list:
    speed, top = (c.speeds or (0.15,))[0], (c.torques or (60.0,))[0]
    levels = top * np.array([0.0, 0.5, 1.0, 0.5, 0.0, -0.5, -1.0, -0.5])
    held = round((c.duration or 16.0) / c.period / 16)
    way = np.repeat([speed, -speed], 8 * held)
    torque = profiles.framed(np.tile(np.repeat(levels, held), 2), c.period)
    return [('load_steps', 'velocity', profiles.eased(profiles.framed(way, c.period), c.period),
             torque)]


def _swept(shape: str) -> Callable[[Choices], list]:
    def law(c: Choices) -> list:
        time, size = _time(20.0, c), (c.amplitudes or (2.0,))[0]
        low, high = (c.frequencies + (0.5, 30.0)[len(c.frequencies):])[:2]
        wave = (profiles.chirp(time, low, high) if shape == 'chirp'
                else profiles.multisine(time, low, high, 24, 1))
        fade = np.clip(np.minimum(time, time[-1] - time) / 0.5, 0.0, 1.0)
        return [(shape, 'voltage', profiles.framed(size * fade * wave, c.period), 0.0)]
    return law


def _slow_reversals(c: Choices) -> list:
    time = _time(16.0, c)
    turns = time * (c.frequencies or (0.25,))[0]
    wave = (c.speeds or (0.05,))[0] * profiles.triangle(turns)
    return [('slow_reversals', 'velocity', profiles.framed(wave, c.period), 0.0)]


def _hold(c: Choices) -> list:
    time = _time(12.0, c)
    torque = (c.torques or (60.0,))[0] * profiles.triangle(time / 6.0)
    return [('hold', 'velocity', np.zeros(len(time)), torque)]


def _coast_down(c: Choices) -> list:
    time, push = _time(16.0, c), (c.amplitudes or (2.2,))[0]
    place = time // 4.0
    wave = np.where(time % 4.0 < 1.5, push, 0.0) * np.where(place % 2, -1.0, 1.0)
    return [('coast_down', 'voltage', profiles.framed(wave, c.period), 0.0)]


def _multilevel_steps(c: Choices) -> list:
    """Steps of an order of their own for each amplitude; speeds near zero come with the small."""
    return [(f'multilevel_steps_{u:g}V', 'voltage', profiles.framed(
        u * profiles.staircase(_time(18.0, c), 9, 0.5, round(1e3 * u)), c.period), 0.0)
        for u in c.amplitudes or (1.0, 1.6)]


def _sinusoids(c: Choices) -> list:
    low, high = (c.frequencies + (0.2, 2.0)[len(c.frequencies):])[:2]
    return [(f'sinusoids_{u:g}V_{low:g}-{high:g}Hz', 'voltage', profiles.framed(
        u * profiles.sinusoids(_time(25.0, c), low, high, 5), c.period), 0.0)
        for u in c.amplitudes or (1.0, 1.6)]


PROCEDURES = {p.name: p for p in (
    Procedure('friction', 'a full turn both ways at each of a ladder of speeds', _friction),
    Procedure('backlash', 'a full turn both ways under each of several loads of both signs',
              _backlash),
    Procedure('transmission_error', 'a full turn both ways at several speeds',
              _transmission_error),
    Procedure('open_loop_sine', 'sines of voltage, 1.5 to 1.8 V at 1 and 0.5 Hz',
              _open_loop('sine')),
    Procedure('open_loop_square', 'squares of voltage, 1.5 to 1.8 V at 1 and 0.5 Hz',
              _open_loop('square')),
    Procedure('velocity_loop', 'a sine of speed, 10 deg/s at 1 Hz', _velocity_loop),
    Procedure('reversal', 'a full turn both ways at 3 deg/s', _reversal),
    Procedure('position_ramp', 'a ramp of position and back under 0, 30 and 60 N m',
              _position_ramp),
    Procedure('speed_ladder', 'rising speeds, each forwards and backwards', _speed_ladder),
    Procedure('load_steps', 'steps of load at a constant speed, both ways', _load_steps),
    Procedure('chirp', 'a sine of voltage from 0.5 to 30 Hz', _swept('chirp')),
    Procedure('multisine', 'sines of voltage from 0.5 to 30 Hz at once', _swept('multisine')),
    Procedure('multilevel_steps', 'steps of voltage to nine levels in an order of chance',
              _multilevel_steps),
    Procedure('sinusoids', 'sines of voltage of several sizes and frequencies', _sinusoids),
    Procedure('slow_reversals', 'a triangle of speed through zero', _slow_reversals),
    Procedure('hold', 'standstill under a swinging load', _hold),
    Procedure('coast_down', 'a push, then none, both ways', _coast_down))}
