"""A recording of the third rig: its loop sample by sample, its shafts step by step."""

from __future__ import annotations

from numba import njit
import numpy as np

from .loop_and_readings import command_of, counted, late, remember, RING
from .shaft_step import (
    AMPS,
    angle_lost,
    directional_friction,
    HUNG,
    PULL,
    QL,
    QM,
    STATES,
    step,
    VL,
    VM,
    WARMTH,
    ZERO,
)
from .terms import (
    CURRENT,
    CURRENT_READING,
    ELEMENTS,
    LOAD_ANGLE,
    LOAD_READING,
    MOTOR_ANGLE,
    MOTOR_READING,
    RISE,
    TIME,
    TORQUE,
    TORQUE_READING,
    total,
    VARIABLES,
)


@njit(cache=True, error_model='numpy')
def run(p, laws, memory, inputs, arrival, jitter, noise, start, begin, period, substeps):
    """
    Return motor angle, load angle, torque, current, command and temperature rise of each sample.

    ``inputs`` (samples, 4): reference position (rad) and speed (rad/s), external torque (N m), and
    a command (V), NaN where the loop is closed; ``arrival``: delay of each command, s; ``jitter``:
    of the instants, s; ``noise`` (samples, 4): of the readings; ``begin``: time of the first
    sample, s. Row k stands at the instant of sample k, before its command acts; a run that ends in
    infinity is NaN from there on.
    """
    samples, h = len(inputs), period / substeps
    out, commands, loop = np.zeros((samples, 6)), np.zeros(samples), np.zeros(4)
    x, s = np.zeros(len(VARIABLES)), np.zeros(STATES)
    z, past = np.zeros((3, ELEMENTS)), np.zeros((3, 3, RING))
    s[QM], s[QL], s[HUNG] = start * p.ratio, start, start
    s[ZERO] = angle_lost(laws, x, s[QM], s[QL])[0]
    past[0, 0, 0] = past[0, 2, 0] = s[QM]
    past[1, 0, 0] = past[1, 2, 0] = s[QL]
    directional = directional_friction(laws)
    arrived, steps = -1, 0
    for k in range(samples):
        # what the sensors read
        x[MOTOR_ANGLE], x[LOAD_ANGLE], x[TORQUE], x[CURRENT] = s[QM], s[QL], s[PULL], s[AMPS]
        x[TIME], x[RISE] = begin + k * period, s[WARMTH]
        motor = late(p.motor_late_kind, p.motor_late, past[0], steps, h, s[QM])
        load = late(p.load_late_kind, p.load_late, past[1], steps, h, s[QL])
        torque = late(p.torque_late_kind, p.torque_late, past[2], steps, h, s[PULL])
        motor += s[VM] * jitter[k] + total(laws, MOTOR_READING, x)[0]
        load += s[VL] * jitter[k] + total(laws, LOAD_READING, x)[0]
        torque += total(laws, TORQUE_READING, x)[0]
        current = s[AMPS] + total(laws, CURRENT_READING, x)[0]
        out[k, 0] = counted(motor + noise[k, 0], p.motor_count)
        out[k, 1] = counted(load + noise[k, 1], p.load_count)
        out[k, 2] = counted(torque + noise[k, 2], p.torque_count)
        out[k, 3] = counted(current + noise[k, 3], p.current_count)
        out[k, 5] = s[WARMTH]

        # the loop
        commands[k] = inputs[k, 3]
        if commands[k] != commands[k]:
            commands[k] = command_of(p, loop, inputs[k, 0], inputs[k, 1], out[k, 0], out[k, 1],
                                   period)
        out[k, 4] = commands[k]

        # up to the next sample
        for i in range(substeps):
            since = k * period + i * h
            while arrived < k and (arrived + 1) * period + arrival[arrived + 1] <= since + 1e-9:
                arrived += 1
            step(p, laws, memory, z, x, s, commands[arrived] if arrived >= 0 else 0.0,
                  inputs[k, 2], begin + since, directional, h)
            steps += 1
            if p.motor_late_kind > 0.0:
                remember(p.motor_late_kind, p.motor_late, past[0], steps, h, s[QM])
            if p.load_late_kind > 0.0:
                remember(p.load_late_kind, p.load_late, past[1], steps, h, s[QL])
            if p.torque_late_kind > 0.0:
                remember(p.torque_late_kind, p.torque_late, past[2], steps, h, s[PULL])
        if not abs(s[QM]) < 1e12:
            out[k:] = np.nan
            break
    return out
