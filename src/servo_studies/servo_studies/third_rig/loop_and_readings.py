"""What happens once a sample: readings that are late and in counts, and the control loop."""

from __future__ import annotations

from math import exp, floor

from numba import njit

from .plant import CONSTANT, FIRST_ORDER, POSITION_LOOP, SPEED_PI

RING = 8192  # steps that a sensor remembers


@njit(cache=True, error_model='numpy')
def command_of(p, s, position, velocity, motor, load, period):
    """
    Return the command, V, of the loop that the servo file names; ``s`` is its memory.

    All of them: a speed from differences of the encoder behind a low pass, and an integral that
    stands still while the command is at its limit.
    """
    angle = motor / p.ratio
    if s[0] == 0.0:
        s[0], s[1] = 1.0, angle
    keep = exp(-period / p.filter) if p.filter > 0.0 else 0.0
    s[2] = keep * s[2] + (1.0 - keep) * (angle - s[1]) / period
    s[1] = angle
    if p.controller == SPEED_PI:
        error = velocity - s[2]
    elif p.controller == POSITION_LOOP:
        error = p.kp * (position - angle) + p.kf * velocity - p.kd * s[2]
    else:
        error = min(max(p.kp * (position - load), -p.speed_limit), p.speed_limit) - s[2]
    more = p.ki * period * error
    command = p.kv * error + s[3] + more
    if abs(command) <= p.limit:
        s[3] += more
    return min(max(command, -p.limit), p.limit)


@njit(cache=True, error_model='numpy')
def late(kind, delay, past, steps, h, now):
    """
    Return a reading as old as its sensor makes it.

    ``past`` (3, RING) holds what was read, its integral and its first-order lag at each step.
    """
    if kind == 0.0 or delay <= 0.0 or steps < 2:
        return now
    if kind == FIRST_ORDER:
        return past[2, steps % RING]
    back = min(delay / h, min(steps, RING) - 1.001)
    whole = int(back)
    newer, older = past[0, (steps - whole) % RING], past[0, (steps - whole - 1) % RING]
    part = back - whole
    if kind == CONSTANT:
        return newer + part * (older - newer)
    area = past[1, steps % RING] - past[1, (steps - whole) % RING]
    return (area / h + part * (newer + 0.5 * part * (older - newer))) / back


@njit(cache=True, error_model='numpy')
def remember(kind, late, past, steps, h, now):
    """Add a reading to the past of a sensor."""
    i, j = steps % RING, (steps - 1) % RING
    before = past[0, j]
    past[0, i], past[1, i] = now, past[1, j] + 0.5 * h * (now + before)
    if kind == FIRST_ORDER:
        gone = 1.0 - exp(-h / late)
        past[2, i] = past[2, j] + gone * (before - past[2, j]) + (now - before) * (
            1.0 - gone * late / h)


@njit(cache=True, error_model='numpy')
def counted(reading, count):
    """Return a reading in whole counts of a sensor; a count of 0 leaves it."""
    return count * floor(reading / count + 0.5) if count > 0.0 else reading
