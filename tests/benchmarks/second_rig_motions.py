"""What the second rig is asked to do: references and external torques by family of excitation."""

from __future__ import annotations

import numpy as np
from second_rig import Machine
from second_rig_machines import Class

SECONDS = 10.0


def motion(family: str, of: Class, machine: Machine, rng: np.random.Generator
           ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return reference position (rad), speed (rad/s), external torque (N m), each (samples,)."""
    t = np.arange(round(SECONDS / machine.period)) * machine.period
    top, external = of.speed * rng.uniform(0.6, 1.0), np.zeros(len(t))
    hardest = 0.7 * of.torque / (machine.load_inertia + machine.rotor_inertia * machine.ratio**2)
    if family == 'ladder':
        rungs = top * np.geomspace(0.03, 1.0, 5)
        speed = np.repeat(np.column_stack((rungs, -rungs)).ravel(), len(t) // 10)
    elif family == 'reversals':
        period = rng.uniform(2.0, 5.0)
        speed = 0.04 * top * np.sign(np.sin(2 * np.pi * t / period))
    elif family == 'load_steps':
        speed = 0.15 * top * np.where(t < 0.5 * SECONDS, 1.0, -1.0)
        steps = np.array([0.0, 0.5, 1.0, 0.3, -0.5, -1.0]) * of.torque * rng.uniform(0.3, 0.6)
        external = steps[(t / 0.8).astype(int) % len(steps)]
    elif family in ('multisine', 'chirp'):
        first, last = rng.uniform(0.2, 0.5), rng.uniform(12.0, 25.0)
        if family == 'chirp':
            phase = 2 * np.pi * first * SECONDS / np.log(last / first) * (
                (last / first)**(t / SECONDS) - 1.0)
            speed, rate = np.sin(phase), first * (last / first)**(t / SECONDS)
            speed = speed * np.minimum(0.4 * top, hardest / (2 * np.pi * rate))
        else:
            lines = np.unique(np.round(np.geomspace(first, last, 25) * SECONDS) / SECONDS)
            size = np.minimum(0.4 * top, hardest / (2 * np.pi * lines))
            speed = 0.35 * np.sum(size[:, None] * np.sin(
                2 * np.pi * lines[:, None] * t + rng.uniform(0, 2 * np.pi, (len(lines), 1))), 0)
    elif family == 'turns':
        speed = 0.5 * top * np.where(t < 0.5 * SECONDS, 1.0, -1.0)
    elif family == 'moves':
        speed = np.zeros(len(t))
        at = 0.3
        while at < SECONDS - 1.5:
            length, size = rng.uniform(0.5, 1.4), rng.uniform(-0.8, 0.8) * top
            speed += size * np.sin(np.pi * np.clip((t - at) / length, 0.0, 1.0))**2
            at += length + rng.uniform(0.1, 0.4)
    else:
        level = rng.uniform(-0.6, 0.6, 13) * top
        speed = level[np.minimum((t / 0.8).astype(int), 12)]
    speed = np.concatenate((speed, np.full(len(t) - len(speed), speed[-1])))[:len(t)]
    if family not in ('multisine', 'chirp', 'moves'):
        speed = _limited(speed, hardest * machine.period)
    position = np.concatenate(([0.0], np.cumsum(speed[:-1]) * machine.period))
    return position, speed, external


def _limited(speed: np.ndarray, most: float) -> np.ndarray:
    """Let a speed change by at most so much from sample to sample."""
    out, now = np.empty_like(speed), 0.0
    for k, wanted in enumerate(speed):
        now += min(max(wanted - now, -most), most)
        out[k] = now
    return out
