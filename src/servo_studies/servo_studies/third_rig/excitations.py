"""What the machines are asked to do: references, external torques and commands by family."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .rig_machine import Machine


class Excitation(NamedTuple):
    """Reference position (rad) and speed (rad/s), external torque (N m), command (V) by sample."""

    position: np.ndarray
    velocity: np.ndarray
    external: np.ndarray
    command: np.ndarray  # NaN where the loop is closed


def excite(machine: Machine, family: str, seconds: float, chance: np.random.Generator
           ) -> Excitation:
    """Return an excitation of a family, other by chance in size and timing. Raises KeyError."""
    t = np.arange(round(seconds / machine.period)) * machine.period
    nothing = np.zeros(len(t))
    position, external, command = {
        'speed_ladder': _ladder, 'slow_reversals': _reversals, 'load_steps': _load_steps,
        'multisine': _multisine, 'chirp': _chirp, 'moves': _moves, 'hold': _hold,
        'turns': _turns, 'open_multisine': _open_multisine}[family](machine, t, chance)
    position = nothing if position is None else position
    velocity = np.gradient(position, machine.period)
    return Excitation(position, velocity, nothing if external is None else external,
                      np.full(len(t), np.nan) if command is None else command)


def _move(start, end, speed, acceleration, period):
    """Return the angles of a trapezoid of speed between two angles, without the first."""
    length = abs(end - start)
    speed = min(speed, np.sqrt(length * acceleration))
    if length == 0.0:
        return np.zeros(0)
    ramp = speed / acceleration
    whole = length / speed + ramp
    t = np.arange(1, int(np.ceil(whole / period)) + 1) * period
    t = np.minimum(t, whole)
    gone = np.where(t < ramp, 0.5 * acceleration * t**2, np.where(
        t < whole - ramp, speed * (t - 0.5 * ramp),
        length - 0.5 * acceleration * (whole - t)**2))
    return start + np.sign(end - start) * gone


def _path(machine, t, stops, acceleration):
    """Return the angles along stops (angle, speed, rest in s), again and again."""
    parts, at, length = [np.zeros(1)], 0.0, 1
    while length < len(t):
        for stop, speed, rest in stops:
            parts += [_move(at, stop, speed, acceleration, machine.period),
                      np.full(int(rest / machine.period), stop)]
            at, length = stop, length + len(parts[-1]) + len(parts[-2])
    return np.concatenate(parts)[:len(t)]


def _ladder(machine, t, chance):
    rungs = np.geomspace(chance.uniform(0.02, 0.05), chance.uniform(0.85, 1.0), 6) * machine.speed
    dwell = t[-1] / 14
    reach = np.minimum(0.45 * machine.travel, 0.5 * rungs * dwell)
    stops = [(way * size, speed, 0.02 * dwell) for size, speed in zip(reach, rungs, strict=True)
             for way in (1, -1)] + [(0.0, rungs[3], 0.0)]
    return _path(machine, t, stops, chance.uniform(0.4, 0.6) * machine.acceleration), None, None


def _reversals(machine, t, chance):
    speed, period = chance.uniform(0.02, 0.06) * machine.speed, chance.uniform(0.15, 0.4) * t[-1]
    reach = min(0.25 * speed * period, 0.8 * machine.travel)
    return _path(machine, t, [(reach, speed, 0.0), (-reach, speed, 0.0)],
                 0.3 * machine.acceleration), None, None


def _steps(machine, t, chance, levels, dwell):
    """Return an external torque in steps that a brake builds up within some samples."""
    signs = np.array([0, 1, 0.4, 0, -0.5, -1, 0.7, -0.7])[:levels]
    size = chance.uniform(0.4, 0.7) * machine.torque
    steps = size * signs[(t / dwell).astype(int) % levels]
    fall = np.exp(-np.arange(200) / max(2.0, 0.02 / machine.period))
    return np.convolve(steps, fall / fall.sum())[:len(t)]


def _load_steps(machine, t, chance):
    speed = chance.uniform(0.06, 0.15) * machine.speed
    reach = min(0.7 * machine.travel, speed * t[-1] / 5)
    position = _path(machine, t, [(reach, speed, 0.0), (-reach, speed, 0.0)],
                     0.3 * machine.acceleration)
    return position, _steps(machine, t, chance, 8, t[-1] / chance.integers(11, 17)), None


def _lines(machine, t, chance, low):
    """Return frequencies (Hz) on lines of the recording, and phases."""
    top = min(chance.uniform(15.0, 25.0), 0.04 / machine.period)
    lines = np.unique(np.round(np.geomspace(low, top, 22) * t[-1])) / t[-1]
    return lines[lines > 0], chance.uniform(0, 2 * np.pi, len(lines[lines > 0]))


def _sum(lines, sizes, phases, t):
    return np.sum(sizes[:, None] * np.sin(2 * np.pi * lines[:, None] * t + phases[:, None]), 0)


def _swell(t):
    """Return what grows smoothly from 0 to 1 over the first tenth."""
    return np.sin(0.5 * np.pi * np.clip(10 * t / t[-1], 0, 1))**2


def _multisine(machine, t, chance):
    lines, phases = _lines(machine, t, chance, 4.0 / t[-1])
    w = 2 * np.pi * lines
    position = _sum(lines, np.minimum(machine.speed / w, machine.acceleration / w**2), phases, t)
    position *= _swell(t)
    velocity = np.gradient(position, machine.period)
    most = max(abs(position).max() / machine.travel, abs(velocity).max() / machine.speed,
               abs(np.gradient(velocity, machine.period)).max() / machine.acceleration)
    return position * chance.uniform(0.5, 0.8) / most, None, None


def _chirp(machine, t, chance):
    low, top = 3.0 / t[-1], min(chance.uniform(15.0, 25.0), 0.04 / machine.period)
    rate = low * (top / low)**(t / t[-1])
    phase = 2 * np.pi * np.concatenate(([0.0], np.cumsum(rate[:-1]))) * machine.period
    size = np.minimum(np.minimum(0.5 * machine.speed / (2 * np.pi * rate),
                                 0.15 * machine.acceleration / (2 * np.pi * rate)**2),
                      0.6 * machine.travel)
    return chance.uniform(0.7, 1.0) * size * np.sin(phase) * _swell(t), None, None


def _moves(machine, t, chance):
    rest = t[-1] / 40
    places = chance.uniform(-0.7, 0.7, 30) * min(machine.travel, machine.speed * t[-1] / 6)
    stops = [(place, chance.uniform(0.4, 1.0) * machine.speed, chance.uniform(0.5, 2.0) * rest)
             for place in places]
    return _path(machine, t, stops, chance.uniform(0.5, 0.8) * machine.acceleration), None, None


def _hold(machine, t, chance):
    cycles, size = chance.uniform(2.0, 4.0), chance.uniform(0.5, 0.8) * machine.torque
    grows = np.clip(0.4 + 0.6 * t / t[-1], 0, 1)
    wave = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * cycles * t / t[-1]))
    return None, size * grows * wave, None


def _turns(machine, t, chance):
    speed = chance.uniform(0.2, 0.5) * machine.speed
    reach = 0.5 * speed * t[-1]
    return _path(machine, t, [(reach, speed, 0.1), (0.0, speed, 0.1)],
                 0.5 * machine.acceleration), None, None


def _open_multisine(machine, t, chance):
    lines, phases = _lines(machine, t, chance, 2.0)
    sizes = machine.scale('load').command * np.minimum(1.0, 6.0 / lines)
    size = (0.2 if machine.plant.resistance else 0.06) * chance.uniform(0.7, 1.2)
    command = _sum(lines, sizes, phases, t) * size
    return None, None, np.clip(command, -machine.plant.limit, machine.plant.limit)
